#include "line_hints.hpp"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "panelgate/line/settings.hpp"
#include "panelgate/yaml/map_reader.hpp"
#include "panelgate/yaml/quote.hpp"

namespace panelgate::config {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; }

std::string lower(std::string_view text) {
    std::string all(text);
    std::ranges::transform(all, all.begin(),
                           [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return all;
}

/// The words and the numbers of a text, in order: 9600, 8, n and 1 of "9600-8N1".
std::vector<std::string> pieces(std::string_view text) {
    std::vector<std::string> all;
    for (std::size_t at = 0; at < text.size();) {
        std::size_t end = at;
        while (end < text.size() && is_digit(text[end])) ++end;
        if (end == at) {
            while (end < text.size() && is_letter(text[end])) ++end;
        }
        if (end > at) all.push_back(lower(text.substr(at, end - at)));
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
    if (host.find('@') != host.npos) return "; leave out what stands before the '@'";
    if (host.starts_with('[')) return "; in brackets stands an IPv6 address, and nothing else";
    return "; HOST is a name of letters, digits, '-', '_' and '.', or an address";
}

/// COM3, \\\\.\\COM12
bool is_com_port(std::string_view text) {
    text.remove_prefix(std::min(text.find_first_not_of("\\./"), text.size()));
    return text.size() > 3 && text.starts_with("com") && is_digit(text[3]);
}

/// Behind tcp://
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
        return "; an IPv6 address stands in brackets: write \"tcp://[" + std::string(host) +
               "]:" + std::string(rest.substr(colon + 1)) + '"';
    return host_hint(host);
}

}  // namespace

std::string serial_example(const yaml::Node* typed) {
    std::string baud;
    std::string parity;
    std::string stop_bits;
    std::string mode;
    for (const std::string& piece : pieces(typed == nullptr ? "" : all_of(*typed))) {
        const auto number = yaml::parse_integer(piece);
        constexpr std::int64_t kLeastBaud = 50;
        if (piece == "ascii" || (piece == "7" && parity.empty())) {
            mode = "ascii";
        } else if (number && *number >= kLeastBaud) {
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
    const std::string text = lower(typed);
    const std::size_t scheme = text.find("://");
    if (scheme != text.npos)
        return "; write tcp://" + std::string(typed.substr(scheme + 3)) + " for RTU over TCP";
    if (text.starts_with("tcp:")) return "; write tcp://" + text.substr(4);
    if (is_com_port(text))
        return "; COM ports are those of Windows: here it is /dev/ttyUSB0 (adapters) or /dev/ttyS0";
    if (text.starts_with("tty") || text.starts_with("dev/") || text.starts_with("serial"))
        return "; write /dev/" + std::string(typed.substr(text.starts_with("dev/") ? 4 : 0));
    if (line::parse_tcp_device("tcp://" + text)) return "; write tcp://" + text;
    return "";
}

}  // namespace panelgate::config
