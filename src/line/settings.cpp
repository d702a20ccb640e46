#include "panelgate/line/settings.hpp"

#include <charconv>

namespace panelgate::line {

std::optional<TcpEndpoint> parse_tcp_device(std::string_view device) {
    constexpr std::string_view kScheme = "tcp://";
    if (!device.starts_with(kScheme)) return std::nullopt;
    device.remove_prefix(kScheme.size());
    const std::size_t colon = device.rfind(':');
    if (colon == device.npos || colon == 0) return std::nullopt;
    std::string_view host = device.substr(0, colon);
    const std::string_view port = device.substr(colon + 1);
    if (host.front() == '[' && host.back() == ']') {
        host = host.substr(1, host.size() - 2);
    } else if (host.find(':') != host.npos) {
        return std::nullopt;  // an IPv6 address wants brackets
    }
    unsigned number = 0;
    const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), number);
    const bool good = error == std::errc() && end == port.data() + port.size();
    if (!good || number == 0 || number > 65535 || host.empty()) return std::nullopt;
    return TcpEndpoint{std::string(host), std::string(port)};
}

}  // namespace panelgate::line
