#include <algorithm>
#include <cstddef>
#include <iostream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "catalogue.hpp"
#include "commands.hpp"
#include "panelgate/base/suggest.hpp"
#include "panelgate/profile/describe.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/tcp_server/register_map_text.hpp"

namespace panelgate::app {
namespace {

constexpr std::string_view kGateway = "gateway";  // no panel, and yet it is asked like one

using Listed = std::vector<std::pair<std::string_view, std::string_view>>;

/// Names and what they are, in two columns.
void print(const Listed& all) {
    std::size_t width = 0;
    for (const auto& [name, description] : all) width = std::max(width, name.size() + 2);
    for (const auto& [name, description] : all)
        std::cout << name << std::string(width - name.size(), ' ') << description << '\n';
}

/// nullptr, and told, when there is none of this name.
const profile::PanelProfile* find(const profile::Catalogue& catalogue, const std::string& name) {
    const profile::PanelProfile* found = catalogue.find(name);
    if (found != nullptr) return found;
    std::vector<std::string_view> names;
    for (const auto& [known, profile] : catalogue.all()) names.push_back(known);
    const std::string near = nearest(name, names);
    std::cerr << "panelgate: there is no profile '" << name << '\'';
    if (!near.empty()) {
        std::cerr << "; did you mean '" << near << "'?\n";
    } else {
        std::cerr << "; `panelgate profiles` lists them\n";
    }
    return nullptr;
}

}  // namespace

ExitCode address(const std::string& name, const std::string& what, const std::string& dir) {
    const auto catalogue = load_catalogue(dir);
    if (!catalogue) return kBadConfig;
    const profile::PanelProfile* profile = find(*catalogue, name);
    if (profile == nullptr) return kUsage;
    const auto text = profile::describe_address(*profile, what);
    if (!text) {
        std::cerr << "panelgate: " << text.error().message << '\n';
        return kUsage;
    }
    std::cout << *text;
    return kFine;
}

ExitCode profiles(const std::string& name, const std::string& dir) {
    const auto catalogue = load_catalogue(dir);
    if (!catalogue) return kBadConfig;
    if (!name.empty()) {
        if (name == kGateway && catalogue->find(name) == nullptr) {
            std::cout << tcp_server::describe_register_map();
            return kFine;
        }
        const profile::PanelProfile* profile = find(*catalogue, name);
        if (profile == nullptr) return kUsage;
        std::cout << profile::describe(*profile);
        return kFine;
    }
    Listed all;
    for (const auto& [known, profile] : catalogue->all())
        all.emplace_back(known, profile.description);
    if (catalogue->find(kGateway) == nullptr)
        all.emplace_back(kGateway, "the gateway's own unit: registers, counters, identification");
    print(all);
    return kFine;
}

}  // namespace panelgate::app
