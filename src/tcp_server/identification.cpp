#include "identification.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/modbus/exception.hpp"
#include "panelgate/modbus/function.hpp"

namespace panelgate::tcp_server {
namespace {

using modbus::ExceptionCode;

constexpr std::uint8_t kBasicStream = 0x01;
constexpr std::uint8_t kRegularStream = 0x02;
constexpr std::uint8_t kIndividual = 0x04;
constexpr std::uint8_t kConformity = 0x83;  // extended, stream and individual access
constexpr std::uint8_t kMoreFollows = 0xFF;
constexpr std::uint8_t kFirstRegular = 0x03;
constexpr std::uint8_t kFirstExtended = 0x80;
constexpr std::size_t kMostExtended = 0x80;
constexpr std::size_t kHeader = 7;    // of the reply's PDU
constexpr std::size_t kLongest = 64;  // characters of an object

struct Object {
    std::uint8_t id;
    std::string_view text;
};

/// Those of this access, in the order of their ids.
std::vector<Object> objects_of(std::uint8_t code, const Diagnostics& state) {
    std::vector<Object> objects = {{0, "panelgate"}, {1, "panelgate"}, {2, state.version},
                                   {3, state.url},   {4, "panelgate"}, {5, "Modbus gateway"},
                                   {6, state.host}};
    for (std::size_t i = 0; i < std::min(state.lines.size(), kMostExtended); ++i)
        objects.push_back({static_cast<std::uint8_t>(kFirstExtended + i), state.lines[i].name});
    std::erase_if(objects, [&](const Object& object) {
        return (code == kBasicStream && object.id >= kFirstRegular) ||
               (code == kRegularStream && object.id >= kFirstExtended);
    });
    for (Object& object : objects) object.text = object.text.substr(0, kLongest);
    return objects;
}

Bytes refuse(ByteView request, ExceptionCode code) {
    return modbus::encode_exception(request[0], code);
}

}  // namespace

Bytes identify(ByteView request, const Diagnostics& state) {
    const std::uint8_t code = request[2];
    if (code < kBasicStream || code > kIndividual)
        return refuse(request, ExceptionCode::illegal_data_value);
    const std::vector<Object> objects = objects_of(code, state);
    auto first = std::ranges::find(objects, request[3], &Object::id);
    if (first == objects.end()) {
        if (code == kIndividual) return refuse(request, ExceptionCode::illegal_data_address);
        first = objects.begin();  // a stream restarts at the beginning (AP 6.21)
    }
    Writer list;
    std::size_t size = kHeader;
    auto next = first;
    const auto end = code == kIndividual ? first + 1 : objects.end();
    for (; next != end && size + 2 + next->text.size() <= modbus::kMaxPdu; ++next) {
        list.u8(next->id).u8(static_cast<unsigned>(next->text.size()));
        for (const char c : next->text) list.u8(static_cast<unsigned char>(c));
        size += 2 + next->text.size();
    }
    const bool more = next != end;
    Writer out(size);
    out.u8(request[0]).u8(modbus::kMeiDeviceIdentification).u8(code).u8(kConformity);
    out.u8(more ? kMoreFollows : 0).u8(more ? next->id : 0);
    out.u8(static_cast<unsigned>(next - first)).raw(list.take());
    return out.take();
}

}  // namespace panelgate::tcp_server
