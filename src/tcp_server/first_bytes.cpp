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

std::string word(modbus::Framing framing) { return std::string(modbus::label(framing)); }

}  // namespace

void FirstBytes::feed(ByteView bytes) {
    if (!watching_) return;
    append_up_to(kKept, bytes_, bytes);
    spoken_ = modbus::other_framing(expected_, bytes_);
    if (spoken_ || bytes_.size() == kKept) on_request();
}

void FirstBytes::on_request() {
    watching_ = false;
    bytes_ = Bytes();
}

std::optional<Unusable> FirstBytes::take_objection() {
    const auto spoken = std::exchange(spoken_, std::nullopt);
    if (!spoken) return std::nullopt;
    return Unusable{"it speaks " + std::string(name_of(*spoken)) +
                        " and needs a listener with framing: " + word(*spoken) +
                        "; this one has framing: " + word(expected_),
                    rt::LogLevel::warn};
}

}  // namespace panelgate::tcp_server
