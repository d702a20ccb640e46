#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "loader.hpp"
#include "panelgate/base/role.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::config {

/// Reads `roles` of `access`. Before what names a role; load_rules() reads the rest of `access`.
void load_own_roles(Loading& loading, yaml::MapReader& root);
/// Reads a key that names a role, a default one or one of the file. `none`: may be none.
std::optional<Standing> load_role(Loading& loading, yaml::MapReader& in, std::string_view key,
                                  bool none = false);
/// True if a token can have this role.
bool is_role(const Config& config, std::string_view word);
/// All of them, for suggestions.
std::vector<std::string_view> role_words(const Config& config);

}  // namespace panelgate::config
