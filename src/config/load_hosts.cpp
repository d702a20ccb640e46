#include "load_hosts.hpp"

#include <algorithm>
#include <string>
#include <string_view>

#include "address_hints.hpp"
#include "panelgate/config/endpoint.hpp"
#include "panelgate/line/settings.hpp"

namespace panelgate::config {
namespace {

/// A name as a browser would send it, or an address without brackets.
bool is_host(std::string_view text) {
    if (text.find('/') == text.npos && parse_cidr(text)) return true;
    if (line::is_broken_address(text)) return false;
    return !text.empty() && !text.ends_with('.') && std::ranges::all_of(text, [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
               c == '-' || c == '.' || c == '_';
    });
}

/// [fd00::1], as an address stands in a URL.
std::string without_brackets(const std::string& text) {
    if (!text.starts_with('[') || !text.ends_with(']')) return text;
    const std::string inside = text.substr(1, text.size() - 2);
    return is_ipv6(inside) ? inside : text;
}

}  // namespace

void load_hosts(Loading& loading, yaml::MapReader& in, web::Settings& settings) {
    const yaml::Node* list = in.sequence("hosts");
    in.looks_like("hosts", "^\\[?[A-Za-z0-9._:-]+\\]?$", true);
    in.entries("hosts", 1, 0);
    if (list == nullptr) return;
    for (const yaml::Node& item : list->items) {
        const std::string host = without_brackets(item.scalar);
        if (is_host(host)) {
            settings.hosts.push_back(host);
        } else {
            loading.problems.add(
                item.mark,
                "hosts lists names such as gateway.plant.example, without http:// "
                "and without a port, not '" +
                    item.scalar + '\'' +
                    (line::is_broken_address(item.scalar) ? "; its numbers are no IP address"
                                                          : missing_commas(item.scalar)));
        }
    }
    if (list->items.empty())
        in.problem("hosts",
                   "hosts must name at least one host; leave it out for the machine's names");
}

}  // namespace panelgate::config
