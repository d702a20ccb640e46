#pragma once

#include <vector>

#include "loader.hpp"

namespace panelgate::config {

/// The key `tokens` of `http`. Secrets are read from their files.
void load_tokens(Loading& loading, yaml::MapReader& in, std::vector<web::Token>& tokens);

}  // namespace panelgate::config
