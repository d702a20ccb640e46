#include "diagnostics.hpp"

#include <string_view>
#include <vector>

#include "identification.hpp"
#include "panelgate/modbus/exception.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "register_map.hpp"

namespace panelgate::tcp_server {
namespace {

using modbus::ExceptionCode;

constexpr std::size_t kMostRegisters = 125;  // of one read, AP 6.3
constexpr std::size_t kMostInputs = 2000;    // AP 6.2
constexpr std::uint8_t kServerId = 'P';      // AP 6.13: the device's own
constexpr std::uint8_t kRunning = 0xFF;
// Sub-functions of 08, AP 6.8.1.
constexpr std::uint16_t kReturnQueryData = 0x00;

Bytes refuse(ByteView request, ExceptionCode code) {
    return modbus::encode_exception(request[0], code);
}

/// What a read of `most` items at once out of `items` is refused for, if it is.
std::optional<ExceptionCode> objection(std::size_t first, std::size_t count, std::size_t most,
                                       std::size_t items) {
    if (count == 0 || count > most) return ExceptionCode::illegal_data_value;
    if (first + count > items) return ExceptionCode::illegal_data_address;
    return std::nullopt;
}

Bytes read_registers(ByteView request, const Diagnostics& state) {
    Reader in(request.subspan(1));
    const std::size_t first = in.u16();
    const std::size_t count = in.u16();
    if (const auto code = objection(first, count, kMostRegisters, kMapRegisters))
        return refuse(request, *code);
    RegisterMap map(state);
    Writer out;
    out.u8(request[0]).u8(static_cast<unsigned>(2 * count));
    for (std::size_t i = first; i < first + count; ++i) out.u16(map.at(i));
    return out.take();
}

Bytes read_inputs(ByteView request, const Diagnostics& state) {
    Reader in(request.subspan(1));
    const std::size_t first = in.u16();
    const std::size_t count = in.u16();
    if (const auto code = objection(first, count, kMostInputs, kMapInputs))
        return refuse(request, *code);
    RegisterMap map(state);
    std::vector<bool> inputs;
    for (std::size_t i = first; i < first + count; ++i) inputs.push_back(map.input(i));
    const Bytes packed = modbus::pack_bits(inputs);
    Writer out;
    out.u8(request[0]).u8(static_cast<unsigned>(packed.size())).raw(packed);
    return out.take();
}

/// The counter that a sub-function of 08 returns; nothing: it does something else.
std::optional<std::uint64_t> counter_of(std::uint16_t sub_function, const Counters& counters) {
    switch (sub_function) {
        case 0x02:  // diagnostic register
        case 0x10:  // negative acknowledgements
        case 0x12:  // overruns of characters
            return 0;
        case 0x0B:
            return counters.requests + counters.protocol_errors;
        case 0x0C:
            return counters.protocol_errors;
        case 0x0D:
            return counters.exceptions;
        case 0x0E:
            return counters.requests;
        case 0x0F:
            return counters.unanswered;
        case 0x11:
            return counters.busy;
        default:
            return std::nullopt;
    }
}

Bytes diagnose(ByteView request, const Counters& counters) {
    Reader in(request.subspan(1));
    const std::uint16_t sub_function = in.u16();
    const std::uint16_t data = in.u16();
    if (sub_function == kReturnQueryData) return Bytes(request.begin(), request.end());
    const auto counter = counter_of(sub_function, counters);
    if (!counter) return refuse(request, ExceptionCode::illegal_function);
    if (data != 0 || request.size() != 5) return refuse(request, ExceptionCode::illegal_data_value);
    Writer out;
    out.u8(request[0]).u16(sub_function).u16(static_cast<std::uint16_t>(*counter));
    return out.take();
}

/// AP 6.9: not busy, and how many requests were completed without an exception.
Bytes count_events(ByteView request, const Counters& counters) {
    Writer out;
    out.u8(request[0]).u16(0);
    out.u16(static_cast<std::uint16_t>(counters.requests - counters.exceptions));
    return out.take();
}

Bytes report_id(ByteView request, const std::string& version) {
    const std::string text = "panelgate " + version.substr(0, 32);
    Writer out;
    out.u8(request[0]).u8(static_cast<unsigned>(2 + text.size())).u8(kServerId).u8(kRunning);
    for (const char c : text) out.u8(static_cast<unsigned char>(c));
    return out.take();
}

/// Those of the functions that it has.
bool has(ByteView request) {
    switch (request[0]) {
        case modbus::kReadDiscreteInputs:
        case modbus::kReadHoldingRegisters:
        case modbus::kReadInputRegisters:
        case modbus::kDiagnostics:
        case modbus::kGetCommEventCounter:
        case modbus::kReportServerId:
            return true;
        case modbus::kEncapsulatedInterface:
            return request.size() < 2 || request[1] == modbus::kMeiDeviceIdentification;
        default:
            return false;
    }
}

}  // namespace

Bytes answer_diagnostics(ByteView request, const Diagnostics& state) {
    if (!has(request)) return refuse(request, ExceptionCode::illegal_function);
    if (!modbus::check_request(request)) return refuse(request, ExceptionCode::illegal_data_value);
    switch (request[0]) {
        case modbus::kReadDiscreteInputs:
            return read_inputs(request, state);
        case modbus::kDiagnostics:
            return diagnose(request, state.counters);
        case modbus::kGetCommEventCounter:
            return count_events(request, state.counters);
        case modbus::kReportServerId:
            return report_id(request, state.version);
        case modbus::kEncapsulatedInterface:
            return identify(request, state);
        default:
            return read_registers(request, state);
    }
}

}  // namespace panelgate::tcp_server
