#include "router.hpp"

#include <gtest/gtest.h>

#include <string>

namespace panelgate::web::access_test {
namespace {

Settings with_tokens(Role anonymous) {
    Settings settings;
    settings.anonymous = anonymous;
    settings.tokens.push_back({"panel", Role::viewer, "see-me"});
    settings.tokens.push_back({"ops", Role::operator_, "let-me"});
    settings.tokens.push_back({"broken", Role::operator_, ""});
    return settings;
}

HttpRequest asking(const std::string& authorization, const std::string& method = "GET") {
    HttpRequest request;
    request.method = method;
    if (!authorization.empty()) request.headers["authorization"] = authorization;
    return request;
}

/// Returns the status of the refusal; 0 if allowed.
unsigned refusal(const HttpRequest& request, Role needed, Role anonymous) {
    const auto refused = check_access(request, needed, with_tokens(anonymous));
    return refused ? refused->status : 0;
}

TEST(Access, NeedsNoTokenForPublicRoutes) {
    EXPECT_EQ(refusal(asking("Bearer wrong"), Role::none, Role::none), 0u);
}

TEST(Access, GivesARequestWithoutATokenTheAnonymousRole) {
    EXPECT_EQ(refusal(asking(""), Role::viewer, Role::none), 401u);
    EXPECT_EQ(refusal(asking(""), Role::viewer, Role::viewer), 0u);
    EXPECT_EQ(refusal(asking(""), Role::operator_, Role::viewer), 401u);
    EXPECT_EQ(refusal(asking(""), Role::operator_, Role::operator_), 0u);
}

TEST(Access, GivesATokenItsOwnRoleEvenWhereAnonymousMayDoMore) {
    EXPECT_EQ(refusal(asking("Bearer see-me"), Role::viewer, Role::none), 0u);
    EXPECT_EQ(refusal(asking("Bearer see-me"), Role::operator_, Role::operator_), 403u);
    EXPECT_EQ(refusal(asking("Bearer let-me"), Role::operator_, Role::none), 0u);
    EXPECT_EQ(refusal(asking("Bearer wrong"), Role::viewer, Role::operator_), 401u);
}

TEST(Access, ReturnsTheRoleOfTheClient) {
    const Settings settings = with_tokens(Role::viewer);
    EXPECT_EQ(role_of(asking(""), settings), Role::viewer);
    EXPECT_EQ(role_of(asking("Bearer let-me"), settings), Role::operator_);
    EXPECT_EQ(role_of(asking("Bearer see-me"), settings), Role::viewer);
    EXPECT_EQ(role_of(asking("Bearer wrong"), settings), Role::none);
}

TEST(Access, TakesASecretOnlyWholeAndNeverAnEmptyOne) {
    for (const char* token : {"let-m", "let-mee", "let-melet-me", "LET-ME", "", "let me"}) {
        EXPECT_EQ(refusal(asking(std::string("Bearer ") + token), Role::viewer, Role::none), 401u)
            << token;
    }
}

TEST(Access, ReadsTheSchemeWithoutRegardToCase) {
    EXPECT_EQ(refusal(asking("bEARER let-me"), Role::operator_, Role::none), 0u);
    EXPECT_EQ(refusal(asking("Bearer  let-me"), Role::operator_, Role::none), 0u);
    for (const char* text : {"Basic let-me", "Bearer", "Bearerlet-me", "let-me"}) {
        EXPECT_EQ(refusal(asking(text), Role::viewer, Role::none), 401u) << text;
    }
}

TEST(Access, OfAnotherSchemeSaysWhichIsMeantAndRepeatsNothing) {
    for (const char* text : {"Basic bGV0LW1l", "let-me"}) {
        const auto refused = check_access(asking(text), Role::viewer, with_tokens(Role::none));
        ASSERT_TRUE(refused);
        EXPECT_EQ(refused->detail,
                  "this gateway knows tokens only; send 'Authorization: Bearer TOKEN'");
        EXPECT_FALSE(carries_token(asking(text)));
    }
    EXPECT_TRUE(carries_token(asking("Bearer wrong")));
}

TEST(Access, TakesABodyOnlyAsItIs) {
    HttpRequest request = asking("", "PUT");
    request.headers["content-encoding"] = "gzip";
    EXPECT_FALSE(check_encoding(request)) << "nothing is coded";
    request.body = "x";
    ASSERT_TRUE(check_encoding(request));
    EXPECT_EQ(check_encoding(request)->status, 415u);
    request.headers["content-encoding"] = "Identity";
    EXPECT_FALSE(check_encoding(request));
}

TEST(Access, SaysHowToAskAgain) {
    const auto refused = check_access(asking(""), Role::viewer, with_tokens(Role::none));
    ASSERT_TRUE(refused);
    ASSERT_EQ(refused->headers.size(), 1u);
    EXPECT_EQ(refused->headers[0].first, "WWW-Authenticate");
    EXPECT_EQ(refused->headers[0].second, "Bearer realm=\"panelgate\"");
}

TEST(Access, WantsNoTypeOfWhatHasNoBody) {
    HttpRequest request = asking("", "DELETE");
    request.headers["origin"] = "http://gateway";
    EXPECT_EQ(refusal(request, Role::operator_, Role::operator_), 0u);
}

TEST(Access, TakesNoFormFromAForeignPage) {
    HttpRequest request = asking("", "POST");
    request.headers["origin"] = "http://evil.example";
    EXPECT_EQ(refusal(request, Role::operator_, Role::operator_), 415u);
    request.headers["content-type"] = "text/plain";
    EXPECT_EQ(refusal(request, Role::operator_, Role::operator_), 415u);
    request.headers["content-type"] = "application/jsonp";
    EXPECT_EQ(refusal(request, Role::operator_, Role::operator_), 415u);
    for (const char* type :
         {"application/json", "Application/JSON", "application/json ; charset=utf-8"}) {
        request.headers["content-type"] = type;
        EXPECT_EQ(refusal(request, Role::operator_, Role::operator_), 0u) << type;
    }
    request.headers.erase("content-type");
    request.method = "GET";
    EXPECT_EQ(refusal(request, Role::viewer, Role::viewer), 0u);
}

}  // namespace
}  // namespace panelgate::web::access_test
