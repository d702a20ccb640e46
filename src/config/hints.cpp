#include "hints.hpp"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "panelgate/base/text.hpp"
#include "panelgate/config/endpoint.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::config {

namespace {

bool is_port(std::string_view text) {
    const auto port = yaml::parse_integer(text);
    return port && *port >= 0 && *port <= 65535;
}

std::string write(std::string_view text) { return "; write " + std::string(text); }

bool is_letter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Returns the words and numbers of a text, in order: 9600, 8, n and 1 of "9600-8N1".
std::vector<std::string> pieces(std::string_view text) {
    std::vector<std::string> all;
    for (std::size_t at = 0; at < text.size();) {
        const auto of_kind = is_digit(text[at]) ? is_digit : is_letter;
        std::size_t end = at;
        while (end < text.size() && of_kind(text[end])) ++end;
        if (end > at) all.push_back(to_lower(text.substr(at, end - at)));
        at = std::max(end, at + 1);
    }
    return all;
}

/// For what follows tcp://
std::string tcp_hint(std::string_view typed) {
    const std::string rest(typed.substr(0, typed.find('/')));
    if (line::parse_tcp_device("tcp://" + rest)) return write("tcp://" + rest);
    if (line::parse_tcp_device("tcp://" + rest + ":4001"))
        return "; add the port, such as tcp://" + rest + ":4001";
    const std::string host = rest.substr(0, rest.rfind(':'));
    if (line::is_broken_address(host)) return "; " + yaml::quote(host) + " is no IP address";
    return "; HOST is a name of letters, digits, '-', '_' and '.', or an address, IPv6 in brackets";
}

/// For a device of a scheme that other programs have (Telegraf, Home Assistant, pyserial).
std::string scheme_hint(std::string_view scheme, std::string_view rest) {
    const std::string place(rest.substr(0, rest.find_first_of("/?")));
    if (scheme.starts_with("mod")) {
        const std::string tail = line::parse_tcp_device("tcp://" + place) ? "" : ":502";
        if (!line::parse_tcp_device("tcp://" + place + tail)) return tcp_hint(rest);
        return write("modbus-tcp://" + place + tail) +
               " for a device that speaks Modbus/TCP, or tcp:// where the far end takes RTU frames "
               "over TCP (raw, transparent)";
    }
    if (scheme == "file") return write(rest.starts_with('/') ? rest : "/dev/" + std::string(rest));
    const std::string device = "tcp://" + place;
    if (scheme == "rfc2217" || scheme == "telnet")
        return "; " + std::string(scheme) +
               " mixes bytes of its own in: set the device server's port to raw TCP (ser2net: "
               "accepter tcp, without telnet), then write " +
               device;
    return write(device) + " for RTU over TCP";
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

std::string listen_hint(std::string_view typed) {
    if (const std::size_t scheme = typed.find("://"); scheme != typed.npos)
        typed.remove_prefix(scheme + 3);
    std::string text(typed.substr(0, typed.find('/')));
    const std::size_t colon = text.rfind(':');
    const std::string host = text.substr(0, colon == text.npos ? text.size() : colon);
    const std::string port = colon == text.npos ? text : text.substr(colon + 1);
    if (parse_endpoint(text)) return write(text);
    if (is_port(port) && (colon == text.npos || host.empty() || host == "*"))
        return write("0.0.0.0:" + port) +
               " for all addresses of this machine, or 127.0.0.1:" + port +
               " for this machine alone";
    if (is_port(port) && host == "localhost") return write("127.0.0.1:" + port);
    if (is_port(port) && is_ipv6(host)) return write("\"[" + host + "]:" + port + "\", in quotes");
    if (parse_cidr(text))
        return "; add the port, such as " +
               (is_ipv6(text) ? "\"[" + text + "]:502\"" : text + ":502");
    if (line::is_broken_address(host)) return "; " + yaml::quote(host) + " is no IP address";
    if (colon == text.npos || is_port(port))
        return "; names are not looked up here: write an address of this machine";
    return yaml::parse_integer(port) ? "; a port is a number from 0 to 65535" : "";
}

std::string network_hint(std::string_view typed, std::string_view key) {
    std::string text(typed);
    if (text == "*" || text == "all" || text == "any")
        return "; to let everybody in, leave " + std::string(key) + " out";
    if (text == "localhost") return write("127.0.0.1");
    if (parse_cidr(text.substr(0, text.find(' '))) && text.find("255.") == text.npos &&
        parse_cidr(text.substr(text.rfind(' ') + 1)))
        return missing_commas(text);
    if (text.find(',') != text.npos) return "; write each network as an item of its own";
    const std::size_t slash = std::min(text.find('/'), text.size());
    const std::string host = text.substr(0, slash);
    if (slash < text.size() && parse_cidr(host))
        return is_ipv6(host) ? "; after the '/' comes a number from 0 to 128"
                             : "; after the '/' comes a number from 0 to 32, such as " + host +
                                   "/24 for the mask 255.255.255.0";
    if (const auto endpoint = parse_endpoint(text))
        return write(endpoint->address) + ", without a port";
    if (text.find('-') != text.npos && parse_cidr(text.substr(0, text.find('-'))))
        return "; a range is written as networks, such as 192.168.1.0/28";
    return line::is_broken_address(host) ? "; " + yaml::quote(host) + " is no IP address" : "";
}

std::string serial_example(const yaml::Node* typed) {
    std::string all = typed == nullptr ? "" : typed->scalar;
    if (typed != nullptr)
        for (const yaml::Node& item : typed->items) all += ' ' + item.scalar;
    std::string baud;
    std::string parity;
    std::string stop_bits;
    for (const std::string& piece : pieces(all)) {
        constexpr std::int64_t kMinBaud = 50;
        if (yaml::parse_integer(piece).value_or(0) >= kMinBaud) {
            if (baud.empty()) baud = "baud: " + piece;
        } else if (!parity.empty() && (piece == "1" || piece == "2")) {
            stop_bits = ", stop_bits: " + piece;
        } else if (parity.empty()) {
            for (const std::string_view word : {"none", "even", "odd"})
                if (word == piece || word.substr(0, 1) == piece)
                    parity = ", parity: " + std::string(word);
        }
    }
    const std::string keys = baud + parity + stop_bits;
    if (keys.empty()) return "{baud: 9600, parity: none, stop_bits: 1}";
    return '{' + (keys.starts_with(", ") ? keys.substr(2) : keys) + '}';
}

std::string device_hint(std::string_view typed) {
    const std::string text = to_lower(typed);
    const std::size_t scheme = text.find("://");
    if (text.starts_with("tcp://")) return tcp_hint(typed.substr(scheme + 3));
    if (scheme != text.npos) return scheme_hint(text.substr(0, scheme), typed.substr(scheme + 3));
    if (text.starts_with("com") && text.size() > 3 && is_digit(text[3]))
        return "; COM ports are those of Windows: here it is /dev/ttyUSB0 (adapters) or /dev/ttyS0";
    if (text.starts_with("tty") || text.starts_with("dev/") || text.starts_with("serial"))
        return write("/dev/" + std::string(typed.substr(text.starts_with("dev/") ? 4 : 0)));
    if (line::parse_tcp_device("tcp://" + text))
        return write((text.ends_with(":502") ? "modbus-tcp://" : "tcp://") + text);
    return "";
}

}  // namespace panelgate::config
