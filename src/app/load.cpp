#include "load.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>
#include <sstream>

#include "panelgate/config/real_files.hpp"

namespace panelgate::app {
namespace {

std::optional<std::string> environment(const std::string& name) {
    const char* value = std::getenv(name.c_str());
    if (value == nullptr) return std::nullopt;
    return value;
}

}  // namespace

std::string path_of(const std::string& typed) { return typed == "-" ? "/dev/stdin" : typed; }

Loaded load_file(const std::string& typed) {
    const std::string path = path_of(typed);
    const auto text = config::RealFiles::read_any(path);
    if (!text) {
        const std::string why =
            errno == EPIPE ? "nobody writes to this pipe" : std::strerror(errno);
        std::cerr << "panelgate: cannot read " << path << ": " << why
                  << " (give another file with -c)\n";
        return {std::nullopt, kNoInput, {{path, {0, 0}, "cannot be read: " + why}}};
    }
    return load_text(*text, path);
}

Loaded load_text(std::string_view text, const std::string& name) {
    yaml::Problems problems(name);
    Loaded loaded;
    loaded.config = config::load(text, config::RealFiles(), problems, environment);
    if (!loaded.config) {
        std::cerr << problems.text();
        loaded.code = kBadConfig;
        loaded.problems = problems.list();
    }
    return loaded;
}

std::optional<config::Config> read_quietly(const std::string& typed) {
    const std::string path = path_of(typed);
    const auto text = config::RealFiles::read_any(path);
    if (!text) return std::nullopt;
    yaml::Problems problems(path);
    return config::load(*text, config::RealFiles(), problems, environment);
}

void print_warnings(const config::Config& config) {
    for (const std::string& warning : config.warnings) std::cerr << warning << '\n';
}

}  // namespace panelgate::app
