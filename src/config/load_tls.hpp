#pragma once

#include <optional>

#include "loader.hpp"
#include "panelgate/tls/settings.hpp"

namespace panelgate::config {

/// Reads the key `tls` of a listener with its files; nothing without it. Files that cannot serve
/// are problems.
std::optional<tls::Settings> load_tls(Loading& loading, yaml::MapReader& in);

}  // namespace panelgate::config
