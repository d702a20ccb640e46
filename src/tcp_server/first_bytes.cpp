#include "first_bytes.hpp"

#include <cstddef>
#include <cstdlib>
#include <string>
#include <string_view>
#include <utility>

#include "panelgate/modbus/ascii_frame.hpp"

namespace panelgate::tcp_server {
namespace {

constexpr std::size_t kKept = modbus::kMaxAsciiAdu;

std::string word(modbus::Framing framing) { return std::string(modbus::label(framing)); }

/// The first line of a request (RFC 9112, 3), whatever its method is.
bool speaks_http(ByteView first) {
    const std::string text(first.begin(), first.end());
    const std::string line = text.substr(0, text.find('\r'));
    const std::size_t method = line.find(' ');
    const std::size_t version = line.rfind(" HTTP/1.");
    return method != line.npos && version != line.npos && method > 0 && method < version &&
           line.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ") == method;
}

std::optional<std::string> foreign(modbus::Framing expected, ByteView first) {
    if (const auto spoken = modbus::other_framing(expected, first))
        return std::string(name_of(*spoken)) +
               " and needs a listener with framing: " + word(*spoken);
    if (speaks_http(first)) return "HTTP and needs the listener of 'http'";
    return std::nullopt;
}

}  // namespace

std::string_view name_of(modbus::Framing framing) {
    switch (framing) {
        case modbus::Framing::tcp:
            return "Modbus/TCP";
        case modbus::Framing::rtu:
            return "Modbus RTU";
        case modbus::Framing::ascii:
            return "Modbus ASCII";
    }
    std::abort();
}

void FirstBytes::feed(ByteView bytes) {
    if (!watching_) return;
    append_up_to(kKept, bytes_, bytes);
    objection_ = foreign(expected_, bytes_);
    if (objection_ || bytes_.size() == kKept) on_request();
}

void FirstBytes::on_request() {
    watching_ = false;
    bytes_ = Bytes();
}

std::optional<Unusable> FirstBytes::take_objection() {
    const auto objection = std::exchange(objection_, std::nullopt);
    if (!objection) return std::nullopt;
    return Unusable{"it speaks " + *objection + "; this one has framing: " + word(expected_),
                    rt::LogLevel::warn};
}

}  // namespace panelgate::tcp_server
