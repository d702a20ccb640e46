#include "load.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iostream>
#include <sstream>

#include "panelgate/config/real_files.hpp"

namespace panelgate::app {

Loaded load_file(const std::string& path) {
    const auto text = config::RealFiles().read(path);
    if (!text) {
        std::cerr << "panelgate: cannot read " << path << ": " << std::strerror(errno)
                  << " (give another file with -c)\n";
        return {std::nullopt, kNoInput};
    }
    return load_text(*text, path);
}

Loaded load_text(std::string_view text, const std::string& name) {
    yaml::Problems problems(name);
    Loaded loaded;
    loaded.config = config::load(text, config::RealFiles(), problems);
    if (!loaded.config) {
        std::cerr << problems.text();
        loaded.code = kBadConfig;
    }
    return loaded;
}

void print_warnings(const config::Config& config) {
    for (const std::string& warning : config.warnings) std::cerr << warning << '\n';
}

}  // namespace panelgate::app
