#include "panelgate/line/settings.hpp"

#include <arpa/inet.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <string>

namespace panelgate::line {
namespace {

bool is_address(int family, std::string_view text) {
    std::array<unsigned char, 16> bytes{};
    return inet_pton(family, std::string(text).c_str(), bytes.data()) == 1;
}

bool is_name(std::string_view host) {
    return std::ranges::all_of(host, [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
               c == '-' || c == '_' || c == '.';
    });
}

}  // namespace

bool is_broken_address(std::string_view host) {
    const std::size_t dot = host.rfind('.');
    const std::string_view last = host.substr(dot == host.npos ? 0 : dot + 1);
    const bool number = last.find_first_not_of("0123456789") == last.npos;
    return number && !host.empty() && !is_address(AF_INET, host);
}

std::optional<TcpEndpoint> parse_tcp_device(std::string_view device) {
    constexpr std::string_view kScheme = "tcp://";
    if (device.starts_with("modbus-tcp://")) device.remove_prefix(7);
    if (!device.starts_with(kScheme)) return std::nullopt;
    device.remove_prefix(kScheme.size());
    const std::size_t colon = device.rfind(':');
    if (colon == device.npos || colon == 0) return std::nullopt;
    std::string_view host = device.substr(0, colon);
    const std::string_view port = device.substr(colon + 1);
    if (host.front() == '[' && host.back() == ']') {
        host = host.substr(1, host.size() - 2);
        if (!is_address(AF_INET6, host.substr(0, host.find('%')))) return std::nullopt;
    } else if (!is_name(host) || is_broken_address(host)) {
        return std::nullopt;  // an IPv6 address wants brackets
    }
    unsigned number = 0;
    const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), number);
    const bool good = error == std::errc() && end == port.data() + port.size();
    if (!good || number == 0 || number > 65535 || host.empty()) return std::nullopt;
    return TcpEndpoint{std::string(host), std::string(port)};
}

}  // namespace panelgate::line
