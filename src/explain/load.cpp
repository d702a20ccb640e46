#include "panelgate/explain/load.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <optional>
#include <string>
#include <utility>

#include "panelgate/config/real_files.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::explain {

std::optional<profile::Catalogue> load_catalogue(const std::string& dir) {
    profile::Catalogue catalogue = profile::Catalogue::shipped();
    if (dir.empty()) return catalogue;
    yaml::Problems problems(dir);
    const auto faults = config::add_profiles(dir, config::RealFiles(), catalogue, problems);
    for (const std::string& fault : faults) std::cerr << "panelgate: --profiles: " << fault << '\n';
    std::cerr << problems.text();
    if (!faults.empty() || !problems.empty()) return std::nullopt;
    return catalogue;
}

namespace {

const std::string kCannotRead = "cannot be read: ";

std::string why_unread(int error) {
    constexpr auto kPatience = config::RealFiles::kReadPatience / 1s;
    if (error == EPIPE) return "no program writes to this pipe";
    if (error != ETIMEDOUT) return std::strerror(error);
    return "its end did not come within " + std::to_string(kPatience) +
           " s; it is a pipe or a device, whose writer waits";
}

std::optional<std::string> environment(const std::string& name) {
    const char* value = std::getenv(name.c_str());
    if (value == nullptr) return std::nullopt;
    return value;
}

}  // namespace

std::string path_of(const std::string& typed) { return typed == "-" ? "/dev/stdin" : typed; }

Loaded read_file(const std::string& path) {
    auto text = config::RealFiles::read_any(path);
    if (!text) {
        return {std::nullopt, kNoInput, {{path, {0, 0}, kCannotRead + why_unread(errno)}}, {}};
    }
    Loaded loaded = read_text(*text, path);
    loaded.text = std::move(*text);
    return loaded;
}

Loaded read_text(std::string_view text, const std::string& name) {
    yaml::Problems problems(name);
    Loaded loaded;
    loaded.config = config::load(text, config::RealFiles(), problems, environment);
    if (!loaded.config) {
        loaded.code = kBadConfig;
        loaded.problems = problems.shown();
        loaded.error_text = problems.text();
    }
    return loaded;
}

Loaded load_file(const std::string& typed, const std::string& option) {
    const std::string path = path_of(typed);
    Loaded loaded = read_file(path);
    if (loaded.code == kNoInput) {
        const std::string why = loaded.problems.front().message.substr(kCannotRead.size());
        const bool is_missing = option == "-c" && why == std::strerror(ENOENT);
        std::cerr << "panelgate: cannot read " << path << ": " << why << " (give another file with "
                  << option
                  << (is_missing ? "; `panelgate demo` needs none, `panelgate init DEVICE -o FILE` "
                                   "writes one"
                                 : "")
                  << ")\n";
    }
    std::cerr << loaded.error_text;
    return loaded;
}

Loaded load_text(std::string_view text, const std::string& name) {
    Loaded loaded = read_text(text, name);
    std::cerr << loaded.error_text;
    return loaded;
}

std::optional<config::Config> read_quietly(const std::string& typed) {
    return read_file(path_of(typed)).config;
}

void print_warnings(const config::Config& config) {
    for (const std::string& warning : config.warnings) std::cerr << warning << '\n';
}

}  // namespace panelgate::explain
