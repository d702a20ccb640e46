#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

#include "panelgate/web/http/caller.hpp"

namespace panelgate::web {

/// One line of the log at info about what a client did or was refused: its name (address, token)
/// first, as `client`. Texts of the client are cut where they are long.
void log_client(const Caller& caller, std::string_view event,
                std::initializer_list<std::pair<std::string_view, std::string>> fields);

}  // namespace panelgate::web
