#pragma once

#include <optional>
#include <string>

#include "panelgate/profile/load_profile.hpp"

namespace panelgate::app {

/// The shipped profiles, and those of --profiles DIR when it is not empty; nothing, and told, when
/// something is wrong there.
std::optional<profile::Catalogue> load_catalogue(const std::string& dir);

}  // namespace panelgate::app
