#include "diagnostics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "panelgate/modbus/exception.hpp"
#include "panelgate/modbus/function.hpp"

namespace panelgate::tcp_server {
namespace {

using modbus::ExceptionCode;

constexpr std::uint16_t kMapVersion = 1;
constexpr std::size_t kMaxRegisters = 125;  // of one read, AP 6.3
// Device identification, AP 6.21.
constexpr std::uint8_t kBasicStream = 0x01;
constexpr std::uint8_t kIndividual = 0x04;
constexpr std::uint8_t kConformity = 0x81;  // basic, stream and individual access

Bytes refuse(ByteView request, ExceptionCode code) {
    return modbus::encode_exception(request[0], code);
}

std::uint16_t clamp16(double value) {
    return static_cast<std::uint16_t>(std::clamp(std::round(value), 0.0, 65535.0));
}

std::vector<std::uint16_t> register_map(const Diagnostics& state) {
    const auto uptime = static_cast<std::uint32_t>(to_seconds(state.uptime));
    std::vector<std::uint16_t> map = {kMapVersion, static_cast<std::uint16_t>(state.lines.size()),
                                      static_cast<std::uint16_t>(uptime >> 16),
                                      static_cast<std::uint16_t>(uptime & 0xFFFF)};
    for (const Diagnostics::Line& line : state.lines) {
        map.push_back(line.up ? 1 : 0);
        map.push_back(clamp16(static_cast<double>(line.queue_depth)));
        map.push_back(clamp16(line.load_percent * 10));
    }
    return map;
}

Bytes read_registers(ByteView request, const Diagnostics& state) {
    Reader in(request.subspan(1));
    const std::size_t first = in.u16();
    const std::size_t count = in.u16();
    const std::vector<std::uint16_t> map = register_map(state);
    if (count == 0 || count > kMaxRegisters) {
        return refuse(request, ExceptionCode::illegal_data_value);
    }
    if (first + count > map.size()) return refuse(request, ExceptionCode::illegal_data_address);
    Writer out;
    out.u8(request[0]).u8(static_cast<unsigned>(2 * count));
    for (std::size_t i = first; i < first + count; ++i) out.u16(map[i]);
    return out.take();
}

Bytes identify(ByteView request, const Diagnostics& state) {
    const std::array<std::string_view, 3> objects = {"panelgate", "panelgate", state.version};
    const std::uint8_t code = request[2];
    std::size_t first = request[3];
    if (code < kBasicStream || code > kIndividual) {
        return refuse(request, ExceptionCode::illegal_data_value);
    }
    if (first >= objects.size()) {
        if (code == kIndividual) return refuse(request, ExceptionCode::illegal_data_address);
        first = 0;  // a stream restarts at the beginning (AP 6.21)
    }
    const std::size_t end = code == kIndividual ? first + 1 : objects.size();
    Writer out;
    out.u8(request[0]).u8(modbus::kMeiDeviceIdentification).u8(code).u8(kConformity);
    out.u8(0).u8(0).u8(static_cast<unsigned>(end - first));  // nothing follows
    for (std::size_t i = first; i < end; ++i) {
        const std::string_view text = objects[i].substr(0, 64);
        out.u8(static_cast<unsigned>(i)).u8(static_cast<unsigned>(text.size()));
        for (const char c : text) out.u8(static_cast<unsigned char>(c));
    }
    return out.take();
}

}  // namespace

Bytes answer_diagnostics(ByteView request, const Diagnostics& state) {
    const bool registers =
        request[0] == modbus::kReadHoldingRegisters || request[0] == modbus::kReadInputRegisters;
    const bool identification =
        request[0] == modbus::kEncapsulatedInterface &&
        (request.size() < 2 || request[1] == modbus::kMeiDeviceIdentification);
    if (!registers && !identification) return refuse(request, ExceptionCode::illegal_function);
    const std::size_t length = registers ? 5 : 4;
    if (request.size() != length) {
        return refuse(request, ExceptionCode::illegal_data_value);
    }
    return registers ? read_registers(request, state) : identify(request, state);
}

}  // namespace panelgate::tcp_server
