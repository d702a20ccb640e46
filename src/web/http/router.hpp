#pragma once

#include <optional>
#include <string>

#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/problem.hpp"
#include "panelgate/web/http/settings.hpp"
#include "shared.hpp"

namespace panelgate::web {

/// May this request do what needs the role? 401 for a wrong token, or for none where one would
/// help; 403 for a token whose role is not enough. A request that changes something and comes from
/// a browser (Origin) must say application/json (415): a foreign page cannot do that unasked.
std::optional<Problem> check_access(const HttpRequest& request, Role needed,
                                    const Settings& settings);

/// It carries a token, right or wrong: all else in its Authorization is no guess.
bool carries_token(const HttpRequest& request);

/// 415 for a body that was compressed, or coded in any other way: nobody here decodes it.
std::optional<Problem> check_encoding(const HttpRequest& request);

/// What it may do, by its token or without one; none for a token that nobody has.
Role role_of(const HttpRequest& request, const Settings& settings);

/// The name of the token that it carries, "" without one that is known.
std::string token_name(const HttpRequest& request, const Settings& settings);

/// Finds the handler and calls it, when the request may. 404 for an unknown path, 405 with Allow
/// for a method the path does not have. HEAD is answered as GET; whoever sends it leaves out the
/// body. `barred` is the answer to everything but probes. `shared` outlives it, and the site
/// as long as the caller has not left.
Handling dispatch(HttpRequest request, Shared* shared, std::optional<Problem> barred = {});

}  // namespace panelgate::web
