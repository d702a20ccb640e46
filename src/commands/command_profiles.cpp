// address and profiles: what the program knows of panels, and of those that a file describes.
#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "commands.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/config/real_files.hpp"
#include "panelgate/explain/load.hpp"
#include "panelgate/profile/describe.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/tcp_server/listener.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::commands {

namespace {

constexpr std::string_view kGateway = "gateway";  // not a panel, but asked for like one

using Listed = std::vector<std::pair<std::string_view, std::string_view>>;

/// Prints names and descriptions in two columns.
void print(const Listed& all) {
    std::size_t width = 0;
    for (const auto& [name, description] : all) width = std::max(width, name.size() + 2);
    for (const auto& [name, description] : all)
        std::cout << name << std::string(width - name.size(), ' ') << description << '\n';
}

/// The profile of this name; nullptr with a message on stderr if there is none.
const profile::PanelProfile* find(const profile::Catalogue& catalogue, const std::string& name) {
    const profile::PanelProfile* found = catalogue.find(name);
    if (found != nullptr) return found;
    std::vector<std::string_view> names;
    for (const auto& [known, profile] : catalogue.all()) names.push_back(known);
    std::string near = nearest(name, names);
    const auto holds = [&](std::string_view known) { return known.find(name) != known.npos; };
    const auto part = std::ranges::find_if(names, holds);
    if (near.empty() && !name.empty() && part != names.end()) near = *part;
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
    const auto catalogue = explain::load_catalogue(dir);
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

namespace {

/// Prints the content of a valid profile file, so that the author sees how the file was understood.
void print_valid(const std::string& file, const profile::PanelProfile& read) {
    const auto count = [](std::size_t number, const char* what) {
        return std::to_string(number) + ' ' + what + (number == 1 ? "" : "s");
    };
    std::cout << file << " is valid: profile " << read.name << ", "
              << count(read.areas.size(), "area") << ", "
              << count(read.functions.size(), "function") << ", "
              << count(read.identification.size(), "identification") << '\n';
    if (profile::Catalogue::shipped().find(read.name) != nullptr)
        std::cerr << file
                  << ": warning: in a profiles_dir it takes the place of the shipped profile "
                  << read.name << '\n';
    if (std::filesystem::path(file).extension() != ".yaml")
        std::cerr << file << ": warning: a profiles_dir takes files whose names end in .yaml\n";
}

}  // namespace

ExitCode check_profile_file(const std::string& typed) {
    const std::string file = explain::path_of(typed);
    const auto text = config::RealFiles::read_any(file);
    if (!text) {
        std::cerr << "panelgate: cannot read " << file << ": " << std::strerror(errno) << '\n';
        return kNoInput;
    }
    yaml::Problems problems(file);
    const auto read =
        profile::load_profile(*text, std::filesystem::path(file).stem().string(), problems);
    std::cerr << problems.text();
    if (!read) return kBadConfig;
    print_valid(file, *read);
    return kFine;
}

ExitCode profiles(const std::string& name, const std::string& dir) {
    const auto catalogue = explain::load_catalogue(dir);
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

}  // namespace panelgate::commands
