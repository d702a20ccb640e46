#pragma once

#include <optional>
#include <string>

#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/problem.hpp"
#include "panelgate/web/http/settings.hpp"
#include "shared.hpp"

namespace panelgate::web {

/// Checks whether the request has the role. 401 for a wrong token, or for none where one would
/// help; 403 for an insufficient role. A browser's request (Origin) that changes something must be
/// application/json (415), which a foreign page cannot send unasked.
/// `right`: what a role of the configuration has to have; `or_right`: what is enough for it, too.
std::optional<Problem> check_access(const HttpRequest& request, Role needed,
                                    const Settings& settings, Right right = Right::read,
                                    std::optional<Right> or_right = std::nullopt);

/// True if it carries a token, right or wrong; any other Authorization is no guess.
bool carries_token(const HttpRequest& request);

/// Returns 415 for a compressed or otherwise encoded body, which is not supported.
std::optional<Problem> check_encoding(const HttpRequest& request);

/// Returns the role of the request's token; without a token the role of its certificate, where the
/// listener goes by certificates; else the anonymous role. Role::none for an unknown token.
Standing standing_of(const HttpRequest& request, const Settings& settings);

/// Returns the name of its token, "" without a known one.
std::string token_name(const HttpRequest& request, const Settings& settings);

/// How long the token of this name ("": none) still counts, at most `most`; zero: it has expired.
Duration time_of_token(const std::string& name, const Site& site, Duration most);

/// Bytes that the body of a request with this head may have. Counts a wrong token.
std::size_t longest_body(HttpRequest head, Shared& shared);

/// Calls the route's handler if the request may use it. 404 for an unknown path, 405 with Allow for
/// a method the path lacks. HEAD is answered like GET; the sender omits the body. `barred`, if set,
/// is the reply to everything but probes. `shared` must outlive it; the site, only until the caller
/// has left.
Handling dispatch(HttpRequest request, Shared* shared, std::optional<Problem> barred = {});

}  // namespace panelgate::web
