#include "hints.hpp"

#include <algorithm>
#include <bit>
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <vector>

#include "panelgate/base/text.hpp"
#include "panelgate/config/endpoint.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/yaml/document.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::config {

namespace {

bool is_port(std::string_view text) {
    const auto port = yaml::parse_integer(text);
    return port && *port >= 0 && *port <= 65535;
}

std::string write(std::string_view text) { return "; write " + std::string(text); }

/// Removes `http://` and what follows host and port.
std::string_view bare(std::string_view text) {
    const std::size_t scheme = text.find("://");
    if (scheme != text.npos) text.remove_prefix(scheme + 3);
    return text.substr(0, text.find('/'));
}

std::string port_hint(std::string_view port) {
    return write("0.0.0.0:" + std::string(port)) +
           " for all addresses of this machine, or 127.0.0.1:" + std::string(port) +
           " for this machine alone";
}

std::string host_hint(const std::string& host, std::string_view port) {
    if (host.empty() || host == "*") return port_hint(port);
    if (host == "localhost") return write("127.0.0.1:" + std::string(port));
    const auto address = parse_cidr(host);
    if (address && is_ipv6(address->address))
        return write("\"[" + host + "]:" + std::string(port) + "\", in quotes");
    if (line::is_broken_address(host)) return "; " + yaml::quote(host) + " is no IP address";
    return "; names are not looked up here: write an address of this machine";
}

/// Returns the prefix length of 255.255.255.0; nothing if its set bits are not the first.
std::optional<int> prefix_of_mask(const std::string& mask) {
    if (!parse_cidr(mask) || is_ipv6(mask)) return std::nullopt;
    std::uint32_t bits = 0;
    for (std::size_t at = 0, part = 0; part < 4; ++part) {
        const std::size_t dot = std::min(mask.find('.', at), mask.size());
        bits = (bits << 8U) | static_cast<std::uint32_t>(std::stoul(mask.substr(at, dot - at)));
        at = dot + 1;
    }
    const int prefix = std::countl_one(bits);
    if (std::popcount(bits) != prefix) return std::nullopt;
    return prefix;
}

/// True for 127.0.0.1 10.0.0.0/8
bool is_several(std::string_view text) {
    const std::size_t blank = text.find(' ');
    if (blank == text.npos) return parse_cidr(std::string(text)).has_value();
    return parse_cidr(std::string(text.substr(0, blank))) && is_several(text.substr(blank + 1));
}

/// Returns the network meant by 10.0.* or 10.0.0
std::string open_ended(std::string text) {
    while (text.ends_with(".*")) text.resize(text.size() - 2);
    if (text.ends_with('.')) text.pop_back();
    const auto parts = static_cast<std::size_t>(std::ranges::count(text, '.')) + 1;
    if (parts > 3) return "";
    const std::string prefix = std::to_string(8 * parts);
    for (std::size_t i = parts; i < 4; ++i) text += ".0";
    const auto network = parse_cidr(text);
    return network && !is_ipv6(network->address) ? write(text + '/' + prefix) : "";
}

}  // namespace

std::string missing_commas(std::string_view typed) {
    std::string list;
    std::size_t parts = 0;
    for (std::size_t at = 0; at < typed.size(); ++parts) {
        const std::size_t end = std::min(typed.find(' ', at), typed.size());
        if (end == at) return "";
        list += (at > 0 ? ", " : "") + std::string(typed.substr(at, end - at));
        at = end + 1;
    }
    constexpr std::size_t kMost = 10;
    return parts > 1 && parts <= kMost ? "; a ',' is missing: write [" + list + ']' : "";
}

std::string number_key_hint(const yaml::Entry& entry) {
    if (!yaml::parse_integer(entry.value.scalar)) return yaml::number_blank_hint(entry.key);
    return write(entry.value.scalar + ": " + entry.key);
}

std::string listen_hint(std::string_view typed) {
    const std::string_view text = bare(typed);
    if (is_port(text)) return port_hint(text);
    const std::string whole(text);
    if (parse_endpoint(text)) return write(text);
    // ::1:502 is an address too, but rarely meant as one.
    const std::size_t last = whole.rfind(':');
    const bool is_v6 = last != whole.npos && is_ipv6(whole.substr(0, last));
    if (is_v6 && is_port(text.substr(last + 1)))
        return host_hint(whole.substr(0, last), text.substr(last + 1));
    if (parse_cidr(whole))
        return "; add the port, such as " +
               (is_ipv6(whole) ? "\"[" + whole + "]:502\"" : whole + ":502");
    const std::size_t colon = text.find_last_of(": ");
    if (colon == text.npos) return "";
    const std::string_view port = text.substr(colon + 1);
    std::string host(text.substr(0, text.find_last_not_of(": ", colon) + 1));
    if (is_port(port)) return host_hint(host, port);
    return yaml::parse_integer(port) ? "; a port is a number from 0 to 65535" : "";
}

std::string network_hint(std::string_view typed, std::string_view key) {
    std::string text(typed);
    if (const std::size_t blank = text.find(' '); blank != text.npos)
        if (const auto prefix = prefix_of_mask(text.substr(text.find_last_of(' ') + 1));
            prefix.value_or(0) > 0 && parse_cidr(text.substr(0, blank)))
            return write(text.substr(0, blank) + '/' + std::to_string(*prefix));
    if (text.find(' ') != text.npos && is_several(text)) return missing_commas(text);
    std::erase(text, ' ');
    if (text == "*" || text == "all" || text == "any")
        return "; to let everybody in, leave " + std::string(key) + " out";
    if (text == "localhost") return write("127.0.0.1");
    if (text.starts_with('[') && text.ends_with(']')) text = text.substr(1, text.size() - 2);
    if (parse_cidr(text)) return write(text);
    if (text.find(',') != text.npos) return "; write each network as an item of its own";
    const std::size_t slash = std::min(text.find('/'), text.size());
    const std::string host = text.substr(0, slash);
    if (slash < text.size() && parse_cidr(host)) {
        if (const auto prefix = prefix_of_mask(text.substr(slash + 1)))
            return write(host + '/' + std::to_string(*prefix));
        if (host.find('.') != host.npos && is_ipv6(host))
            return "; an IPv4 network is written as such: 10.0.0.0/24";
        return is_ipv6(host) ? "; after the '/' comes a number from 0 to 128"
                             : "; after the '/' comes a number from 0 to 32";
    }
    if (const std::string network = open_ended(host); !network.empty()) return network;
    if (const auto endpoint = parse_endpoint(text))
        return write(endpoint->address) + ", without a port";
    if (text.find('-') != text.npos && parse_cidr(text.substr(0, text.find('-'))))
        return "; a range is written as networks, such as 192.168.1.0/28";
    if (line::is_broken_address(host)) return "; " + yaml::quote(host) + " is no IP address";
    return "";
}

namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; }

/// Returns the words and numbers of a text, in order: 9600, 8, n and 1 of "9600-8N1".
std::vector<std::string> pieces(std::string_view text) {
    std::vector<std::string> all;
    for (std::size_t at = 0; at < text.size();) {
        std::size_t end = at;
        while (end < text.size() && is_digit(text[end])) ++end;
        if (end == at) {
            while (end < text.size() && is_letter(text[end])) ++end;
        }
        if (end > at) all.push_back(to_lower(text.substr(at, end - at)));
        at = std::max(end, at + 1);
    }
    return all;
}

std::string all_of(const yaml::Node& node) {
    std::string text = node.scalar;
    for (const yaml::Node& item : node.items) text += ' ' + item.scalar;
    return text;
}

std::string parity_of(const std::string& word) {
    if (word == "n" || word == "none") return "none";
    if (word == "e" || word == "even") return "even";
    return word == "o" || word == "odd" ? "odd" : "";
}

std::string host_hint(std::string_view host) {
    if (line::is_broken_address(host))
        return "; " + yaml::quote(host) +
               " is no IP address: four numbers from 0 to 255, with dots between them";
    if (host.find('@') != host.npos) return "; leave out what is before the '@'";
    if (host.starts_with('[')) return "; only an IPv6 address goes in brackets";
    return "; HOST is a name of letters, digits, '-', '_' and '.', or an address";
}

/// COM3, \\\\.\\COM12
bool is_com_port(std::string_view text) {
    text.remove_prefix(std::min(text.find_first_not_of("\\./"), text.size()));
    return text.size() > 3 && text.starts_with("com") && is_digit(text[3]);
}

/// Hint for what follows tcp://
std::string tcp_hint(std::string_view typed) {
    std::string_view rest = typed.substr(0, typed.find('/'));
    if (line::parse_tcp_device("tcp://" + std::string(rest)))
        return "; write tcp://" + std::string(rest);
    const std::size_t colon = rest.rfind(':');
    if (colon == rest.npos) {
        const std::string device = "tcp://" + std::string(rest) + ":4001";
        return line::parse_tcp_device(device) ? "; add the port, such as " + device
                                              : host_hint(rest);
    }
    const std::string_view host = rest.substr(0, colon);
    if (host.empty() || line::parse_tcp_device("tcp://" + std::string(host) + ":1")) return "";
    if (host.find(':') != host.npos && !host.starts_with('['))
        return "; an IPv6 address goes in brackets: write \"tcp://[" + std::string(host) +
               "]:" + std::string(rest.substr(colon + 1)) + '"';
    return host_hint(host);
}

/// Hint for a device of a scheme that other programs have (Telegraf, Home Assistant, pyserial).
std::string scheme_hint(std::string_view scheme, std::string_view rest) {
    constexpr std::string_view kModbusTcp[] = {"modbus-tcp", "modbus+tcp", "modbus", "mbtcp"};
    if (std::ranges::find(kModbusTcp, scheme) != std::end(kModbusTcp))
        return "; Modbus/TCP devices as lines are not there yet: write tcp:// only where the far "
               "end takes RTU frames over TCP (raw, transparent)";
    if (scheme == "file") return write(rest.starts_with('/') ? rest : "/dev/" + std::string(rest));
    const std::string device = "tcp://" + std::string(rest.substr(0, rest.find_first_of("/?")));
    if (scheme == "rfc2217" || scheme == "telnet")
        return "; " + std::string(scheme) +
               " mixes bytes of its own in: set the device server's port to raw TCP (ser2net: "
               "accepter tcp, without telnet), then write " +
               device;
    return write(device) + " for RTU over TCP";
}

}  // namespace

std::string serial_example(const yaml::Node* typed) {
    std::string baud;
    std::string parity;
    std::string stop_bits;
    std::string mode;
    for (const std::string& piece : pieces(typed == nullptr ? "" : all_of(*typed))) {
        const auto number = yaml::parse_integer(piece);
        constexpr std::int64_t kMinBaud = 50;
        if (piece == "ascii" || (piece == "7" && parity.empty())) {
            mode = "ascii";
        } else if (number && *number >= kMinBaud) {
            if (baud.empty()) baud = piece;
        } else if (number && !parity.empty() && (piece == "1" || piece == "2")) {
            stop_bits = piece;
        } else if (parity.empty()) {
            parity = parity_of(piece);
        }
    }
    std::string keys;
    const auto add = [&keys](std::string_view key, const std::string& value) {
        if (!value.empty()) keys += (keys.empty() ? "" : ", ") + std::string(key) + ": " + value;
    };
    add("mode", mode);
    add("baud", baud);
    add("parity", parity);
    add("stop_bits", stop_bits);
    return keys.empty() ? "{baud: 9600, parity: none, stop_bits: 1}" : '{' + keys + '}';
}

std::string device_hint(std::string_view typed) {
    if (typed.starts_with("tcp://")) return tcp_hint(typed.substr(6));
    const std::string text = to_lower(typed);
    const std::size_t scheme = text.find("://");
    if (scheme != text.npos) return scheme_hint(text.substr(0, scheme), typed.substr(scheme + 3));
    if (text.starts_with("tcp:")) return "; write tcp://" + text.substr(4);
    if (is_com_port(text))
        return "; COM ports are those of Windows: here it is /dev/ttyUSB0 (adapters) or /dev/ttyS0";
    if (text.starts_with("tty") || text.starts_with("dev/") || text.starts_with("serial"))
        return "; write /dev/" + std::string(typed.substr(text.starts_with("dev/") ? 4 : 0));
    if (line::parse_tcp_device("tcp://" + text)) return "; write tcp://" + text;
    return "";
}

}  // namespace panelgate::config
