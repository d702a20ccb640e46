#include "panelgate/config/profiles_dir.hpp"

#include <filesystem>
#include <utility>

namespace panelgate::config {

std::vector<std::string> add_profiles(const std::string& dir, const Files& files,
                                      profile::Catalogue& catalogue, yaml::Problems& problems) {
    const auto paths = files.list_yaml(dir);
    if (!paths) return {"cannot list the directory " + dir};
    std::vector<std::string> unreadable;
    for (const std::string& path : *paths) {
        const auto text = files.read(path);
        if (!text) {
            unreadable.push_back("cannot read " + path);
            continue;
        }
        yaml::Problems own(path);
        auto profile =
            profile::load_profile(*text, std::filesystem::path(path).stem().string(), own);
        problems.take(own);
        if (profile) catalogue.add(std::move(*profile));
    }
    return unreadable;
}

}  // namespace panelgate::config
