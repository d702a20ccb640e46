#pragma once

#include <sys/types.h>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/config/config.hpp"

namespace panelgate::commands {

/// User and group that the unit of the package names.
inline constexpr const char* kServiceUser = "panelgate";

/// The group of the package's service; nothing on a machine without it.
std::optional<gid_t> service_group();

/// What the service's user may not read or write of the files that a configuration names, one
/// sentence each with what to type. Empty unless root asks on a machine with this user. `file`: the
/// configuration's own path. Starts a short child process for each file.
std::vector<std::string> service_doubts(const std::string& file, const config::Config& config);

}  // namespace panelgate::commands
