#include "access.hpp"

#include <string_view>

#include "to_lower.hpp"

namespace panelgate::web {
namespace {

/// In a time that does not depend on where the texts differ.
bool same_secret(std::string_view given, std::string_view secret) {
    unsigned difference = given.size() == secret.size() ? 0 : 1;
    for (std::size_t i = 0; i < given.size(); ++i) {
        const char expected = secret.empty() ? '\0' : secret[i % secret.size()];
        difference |= static_cast<unsigned char>(given[i] ^ expected);
    }
    return difference == 0;
}

std::string_view header(const HttpRequest& request, const char* name) {
    const auto found = request.headers.find(name);
    return found == request.headers.end() ? std::string_view() : found->second;
}

/// The token after "Bearer" and its blanks (RFC 9110 11.4; schemes are compared without
/// case, 11.1).
std::optional<std::string_view> bearer_token(std::string_view authorization) {
    constexpr std::string_view kScheme = "bearer ";
    if (to_lower(authorization.substr(0, kScheme.size())) != kScheme) return std::nullopt;
    authorization.remove_prefix(kScheme.size());
    while (authorization.starts_with(' ')) authorization.remove_prefix(1);
    return authorization;
}

/// The token that it carries; null for one that nobody has. All are compared, whichever matches.
const Token* token_of(const HttpRequest& request, const Settings& settings) {
    const auto given = bearer_token(header(request, "authorization"));
    if (!given) return nullptr;
    const Token* found = nullptr;
    for (const Token& known : settings.tokens) {
        if (same_secret(*given, known.secret) && !known.secret.empty()) found = &known;
    }
    return found;
}

Problem unauthorized(std::string detail) {
    Problem made = problem(401, std::move(detail));
    made.headers.emplace_back("WWW-Authenticate", "Bearer realm=\"panelgate\"");
    return made;
}

/// Media types are compared without case (RFC 9110 8.3.1).
bool is_json(std::string_view content_type) {
    std::string_view type = content_type.substr(0, content_type.find(';'));
    while (type.ends_with(' ') || type.ends_with('\t')) type.remove_suffix(1);
    return to_lower(type) == "application/json";
}

/// What a form of any site could send. DELETE is no method of forms, and has no body.
bool is_foreign_form(const HttpRequest& request) {
    if (request.method == "GET" || request.method == "HEAD" || request.method == "DELETE")
        return false;
    return !header(request, "origin").empty() && !is_json(header(request, "content-type"));
}

}  // namespace

std::optional<Problem> check_access(const HttpRequest& request, Role needed,
                                    const Settings& settings) {
    if (needed == Role::none) return std::nullopt;
    if (is_foreign_form(request)) return problem(415, "send the body as application/json");
    if (header(request, "authorization").empty()) {
        if (settings.anonymous >= needed) return std::nullopt;
        return unauthorized("this needs a token");
    }
    // Nothing of it is repeated: without a scheme it may be the token.
    if (!carries_token(request))
        return unauthorized("this gateway knows tokens only; send 'Authorization: Bearer TOKEN'");
    const Token* token = token_of(request, settings);
    if (token == nullptr) return unauthorized("this token is not known");
    if (token->role < needed) return problem(403, "this needs the role operator");
    return std::nullopt;
}

bool carries_token(const HttpRequest& request) {
    return bearer_token(header(request, "authorization")).has_value();
}

std::optional<Problem> check_encoding(const HttpRequest& request) {
    const std::string_view coding = header(request, "content-encoding");
    if (request.body.empty() || coding.empty() || to_lower(coding) == "identity")
        return std::nullopt;
    Problem made = problem(415, "send the body as it is, without a Content-Encoding");
    made.headers.emplace_back("Accept-Encoding", "identity");  // RFC 9110 15.5.16
    return made;
}

Role role_of(const HttpRequest& request, const Settings& settings) {
    if (header(request, "authorization").empty()) return settings.anonymous;
    const Token* token = token_of(request, settings);
    return token == nullptr ? Role::none : token->role;
}

std::string token_name(const HttpRequest& request, const Settings& settings) {
    const Token* token = token_of(request, settings);
    return token == nullptr ? std::string() : token->name;
}

}  // namespace panelgate::web
