#include "page_file.hpp"

#include <algorithm>
#include <string>

#include "http_rig.hpp"
#include "panelgate/web/http/gzip.hpp"

namespace panelgate::web {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using Page = HttpRig;

constexpr const char* kGzip = "Accept-Encoding: gzip\r\n";

TEST_F(Page, IsServedWithAPolicyThatAllowsNothingElse) {
    const Reply page = get("/");
    EXPECT_EQ(page.status(), 200u);
    EXPECT_EQ(page.header("Content-Type"), "text/html; charset=utf-8");
    const std::string policy = page.header("Content-Security-Policy");
    EXPECT_THAT(policy, HasSubstr("default-src 'self'"));
    EXPECT_THAT(policy, Not(HasSubstr("unsafe")));
    EXPECT_THAT(page.body(), HasSubstr("<script type=\"module\" src=\"page/app.js\">"));
    EXPECT_THAT(page.body(), Not(HasSubstr("@PRELOAD@")));
}

TEST_F(Page, HasAllItsFiles) {
    for (const PageFile& file : shipped_page()) {
        const Reply reply = get("/page/" + std::string(file.name));
        EXPECT_EQ(reply.status(), 200u) << file.name;
        EXPECT_EQ(reply.header("Content-Type"), file.type) << file.name;
        EXPECT_FALSE(reply.body().empty()) << file.name;
    }
    EXPECT_EQ(get("/page/nothing.js").status(), 404u);
    EXPECT_EQ(get("/page/..%2fserver.cpp").status(), 404u);
}

TEST_F(Page, IsSentPackedToWhoTakesIt) {
    const Reply plain = get("/page/app.js");
    const Reply packed = ask("GET", "/page/app.js", "", kGzip);
    EXPECT_EQ(packed.header("Content-Encoding"), "gzip");
    EXPECT_EQ(packed.header("Vary"), "Accept-Encoding");
    EXPECT_EQ(plain.header("Vary"), "Accept-Encoding");
    EXPECT_LT(packed.body().size(), plain.body().size() / 2);
    EXPECT_EQ(unpacked(packed.body()), plain.body());
}

TEST_F(Page, IsNotSentAgainToWhoHasIt) {
    const Reply first = ask("GET", "/page/app.js", "", kGzip);
    const std::string known = "If-None-Match: " + first.header("ETag") + "\r\n";
    const Reply again = ask("GET", "/page/app.js", "", known);
    EXPECT_EQ(again.status(), 304u);
    EXPECT_EQ(again.body(), "");
    EXPECT_EQ(again.header("ETag"), first.header("ETag"));
    EXPECT_EQ(ask("GET", "/page/scope.js", "", known).status(), 200u);
}

/// A browser's first request cannot bring a token: the page asks for one.
TEST_F(Page, IsFreeToAllBecauseDataAreNotInIt) {
    settings.anonymous = Role::none;
    for (const char* free : {"/", "/page/app.js", "/docs"})
        EXPECT_EQ(get(free).status(), 200u) << free;
    for (const char* kept : {"/openapi.json", "/metrics", "/api/v1/lines", "/api/v1/configuration"})
        EXPECT_EQ(get(kept).status(), 401u) << kept;
}

}  // namespace
}  // namespace panelgate::web
