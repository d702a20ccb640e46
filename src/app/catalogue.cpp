#include "catalogue.hpp"

#include <iostream>

#include "panelgate/config/profiles_dir.hpp"
#include "panelgate/config/real_files.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::app {

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

}  // namespace panelgate::app
