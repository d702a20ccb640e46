#include <cerrno>
#include <cstring>
#include <iostream>

#include "commands.hpp"
#include "load.hpp"
#include "panelgate/config/mbusd_conf.hpp"
#include "panelgate/config/real_files.hpp"

namespace panelgate::app {

ExitCode import_conf(const std::string& file) {
    const std::string path = path_of(file);
    const auto text = config::RealFiles::read_any(path);
    if (!text) {
        std::cerr << "panelgate: cannot read " << path << ": " << std::strerror(errno) << '\n';
        return kNoInput;
    }
    yaml::Problems problems(path);
    const auto imported = config::import_mbusd(*text, problems);
    if (!imported) {
        std::cerr << problems.text();
        return kBadConfig;
    }
    std::cout << imported->yaml << std::flush;
    for (const std::string& note : imported->notes) std::cerr << note << '\n';
    return kFine;
}

}  // namespace panelgate::app
