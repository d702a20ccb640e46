#pragma once

#include <string>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/config/config.hpp"

namespace panelgate::config {

/// The real file system. After a failed read errno has the cause; special files (is_special()) are
/// not read (EINVAL).
class RealFiles final : public Files {
  public:
    std::optional<std::string> read(const std::string& path) const override;
    std::optional<std::vector<std::string>> list_yaml(const std::string& dir) const override;
    bool is_readable_by_all(const std::string& path) const override;
    bool is_special(const std::string& path) const override;
    std::string real_path(const std::string& path) const override;

    /// How long the writer of a pipe, or a device, may take to the end of what is read.
    static constexpr Duration kReadPatience = 8s;
    /// Like read(), but also reads a pipe or a device: for paths of the command line. A named pipe
    /// without a writer within a second is not read (EPIPE), nor what does not end within
    /// kReadPatience (ETIMEDOUT); /dev/stdin has no limit.
    static std::optional<std::string> read_any(const std::string& path);
};

/// The path that a text of the configuration `file` means: a relative one is beside it, so that a
/// service and a check find the same wherever they are started. Standard input and pipes are in no
/// folder of their own.
std::string beside(const std::string& file, const std::string& typed);

/// Adds the profiles of a directory to a catalogue; they replace those of the same name. Faults
/// inside a file go to `problems` with that file's name; returns a text for the directory, or each
/// file, that cannot be read.
std::vector<std::string> add_profiles(const std::string& dir, const Files& files,
                                      profile::Catalogue& catalogue, yaml::Problems& problems);

}  // namespace panelgate::config
