#pragma once

#include <string>
#include <vector>

#include "panelgate/config/config.hpp"

namespace panelgate::config {

/// Files of the real file system. After a failed read errno says why; what is_special() is not read
/// (EINVAL).
class RealFiles final : public Files {
  public:
    std::optional<std::string> read(const std::string& path) const override;
    std::optional<std::vector<std::string>> list_yaml(const std::string& dir) const override;
    bool is_readable_by_all(const std::string& path) const override;
    bool is_special(const std::string& path) const override;

    /// As read(), and also from a pipe or a device, for as long as that takes: of what the command
    /// line names. A named pipe that nobody writes to within a second is not read (EPIPE).
    static std::optional<std::string> read_any(const std::string& path);
};

/// Adds the profiles of a directory to a catalogue, or replaces its own by them. What is wrong
/// inside a file goes to `problems`, with that file's name; returns a text for the directory, or
/// for each file, that cannot be read.
std::vector<std::string> add_profiles(const std::string& dir, const Files& files,
                                      profile::Catalogue& catalogue, yaml::Problems& problems);

}  // namespace panelgate::config
