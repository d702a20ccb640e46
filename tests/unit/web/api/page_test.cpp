#include "page.hpp"

#include <algorithm>
#include <string>

#include "http_rig.hpp"
#include "panelgate/web/http/gzip.hpp"

namespace panelgate::web::page_test {
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

TEST_F(Page, IsFreeToWhoMayNotLookButNotUnderAForeignName) {
    settings.anonymous = Role::none;
    for (const char* path : {"/", "/page/app.js", "/docs"}) {
        EXPECT_EQ(get(path).status(), 200u) << path;
        EXPECT_EQ(ask("GET", path, "", "Origin: http://evil.example\r\n").status(), 403u);
        const std::string foreign =
            "GET " + std::string(path) + " HTTP/1.1\r\nHost: evil.example\r\n\r\n";
        Client client = connect();
        client.send(foreign);
        EXPECT_EQ(client.receive().status(), 421u) << path;
    }
    EXPECT_EQ(get("/api/v1/lines").status(), 401u);
    EXPECT_EQ(get("/page/nothing.js").status(), 404u);
}

TEST_F(Page, NamesNothingOfThePlant) {
    for (const char* path : {"/", "/docs"}) {
        const std::string body = get(path).body();
        EXPECT_THAT(body, Not(HasSubstr("floor2"))) << path;
        EXPECT_THAT(body, Not(HasSubstr("/dev/"))) << path;
    }
}

}  // namespace
}  // namespace panelgate::web::page_test
