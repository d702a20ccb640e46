// What the program serves about itself: OpenAPI, /docs, the dashboard and the configuration.
#include <algorithm>
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <cctype>
#include <cstddef>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>

#include "http_rig.hpp"
#include "page.hpp"
#include "panelgate/web/http/gzip.hpp"
#include "routes.hpp"

namespace panelgate::web::docs_test {
namespace {

namespace json = boost::json;
using ::testing::HasSubstr;
using ::testing::Not;

json::object document() { return json::parse(openapi_text()).as_object(); }

std::string text(const json::object& object, const char* name) {
    return std::string(object.at(name).as_string());
}

/// "/lines/{line}" is "/lines/{}".
std::string pattern_of(std::string path) {
    for (std::size_t at = 0; (at = path.find('{', at)) != path.npos; ++at)
        path.erase(at + 1, path.find('}', at) - at - 1);
    return path;
}

struct Documented {
    std::string role;
    std::set<std::string> queries;
    std::set<std::string> headers;
};
using Operations = std::map<std::pair<std::string, std::string>, Documented>;

Documented documented(const json::object& all, const json::object& operation) {
    Documented made{text(operation, "x-role"), {}, {}};
    if (!operation.contains("parameters")) return made;
    const auto& known = all.at("components").at("parameters").as_object();
    for (const json::value& entry : operation.at("parameters").as_array()) {
        const std::string path = text(entry.as_object(), "$ref");
        const json::object& parameter = known.at(path.substr(path.rfind('/') + 1)).as_object();
        const std::string where = text(parameter, "in");
        if (where == "query") made.queries.insert(text(parameter, "name"));
        if (where == "header") made.headers.insert(text(parameter, "name"));
    }
    return made;
}

Operations documented_operations() {
    Operations all;
    const json::object whole = document();
    for (const auto& [path, verbs] : whole.at("paths").as_object()) {
        for (const auto& [verb, operation] : verbs.as_object()) {
            std::string upper(verb);
            std::ranges::transform(upper, upper.begin(),
                                   [](unsigned char c) { return std::toupper(c); });
            all[{upper, pattern_of(std::string(path))}] = documented(whole, operation.as_object());
        }
    }
    return all;
}

TEST(Openapi, HasEveryRouteWithItsRoleItsQueriesAndHeadersAndNoOther) {
    Operations open = documented_operations();
    for (const Route& route : routes(std::make_shared<Api>())) {
        const std::pair key{std::string(route.verb), std::string(route.pattern)};
        const auto found = open.find(key);
        ASSERT_NE(found, open.end())
            << key.first << ' ' << key.second << " is not documented in openapi/paths.json";
        EXPECT_EQ(found->second.role, label(route.needed)) << key.second;
        const std::set<std::string> queries(route.queries.begin(), route.queries.end());
        EXPECT_EQ(found->second.queries, queries) << key.first << ' ' << key.second;
        const bool writes = route.needed >= Role::operator_ &&
                            !route.pattern.starts_with("/api/v1/simulator/") &&
                            (!route.configures || route.pattern.ends_with("/rollback"));
        EXPECT_EQ(found->second.headers.contains("Idempotency-Key"), writes) << key.second;
        open.erase(found);
    }
    for (const auto& [key, operation] : open)
        ADD_FAILURE() << key.first << ' ' << key.second << " is documented, but there is no route";
}

using Page = HttpRig;

TEST_F(Page, OfRestShowsEveryOperationAndEverySchema) {
    const json::object whole = document();
    const std::string page = get("/docs").body();
    for (const auto& [path, verbs] : whole.at("paths").as_object()) {
        for (const auto& [verb, operation] : verbs.as_object())
            EXPECT_THAT(page, HasSubstr("id=\"" + text(operation.as_object(), "operationId")));
    }
    for (const auto& [name, schema] : whole.at("components").at("schemas").as_object())
        EXPECT_THAT(page, HasSubstr("id=\"" + std::string(name) + '"'));
}

TEST_F(Page, OfTheManualIsBesideRestsAndHasAllItsFiles) {
    EXPECT_THAT(get("/docs/").body(), HasSubstr("<h1 id=\"panelgate\">"));
    EXPECT_EQ(get("/docs/").body(), get("/docs/index.html").body());
    EXPECT_EQ(get("/docs/panels/").body(), get("/docs/panels/index.html").body());
    EXPECT_NE(get("/docs/").body(), get("/docs").body());
    for (const PageFile& file : shipped_docs()) {
        const Reply reply = get("/docs/" + std::string(file.name));
        EXPECT_EQ(reply.status(), 200u) << file.name;
        EXPECT_EQ(reply.header("Content-Type"), file.type) << file.name;
        EXPECT_FALSE(reply.body().empty()) << file.name;
    }
    for (const char* path : {"/docs/nothing.html", "/docs/tasks/nothing.html",
                             "/docs/..%2frest.html", "/docs/tasks/tokens.html/more"})
        EXPECT_EQ(get(path).status(), 404u) << path;
}

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
    const Reply docs = get("/docs");
    EXPECT_EQ(docs.status(), 200u);
    EXPECT_EQ(docs.header("Content-Type"), "text/html; charset=utf-8");
    EXPECT_EQ(docs.header("Content-Security-Policy"), policy);
    EXPECT_EQ(get("/openapi.json").at("openapi"), "3.1.0");
    EXPECT_EQ(get("/openapi.json").header("Content-Type"), "application/json");
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

TEST_F(Page, IsSentPackedToWhoTakesItAndNotAgainToWhoHasIt) {
    const Reply plain = get("/page/app.js");
    const Reply packed = ask("GET", "/page/app.js", "", kGzip);
    EXPECT_EQ(packed.header("Content-Encoding"), "gzip");
    for (const Reply& reply : {plain, packed}) EXPECT_EQ(reply.header("Vary"), "Accept-Encoding");
    EXPECT_LT(packed.body().size(), plain.body().size() / 2);
    EXPECT_EQ(unpacked(packed.body()), plain.body());
    const std::string known = "If-None-Match: " + packed.header("ETag") + "\r\n";
    const Reply again = ask("GET", "/page/app.js", "", known);
    EXPECT_EQ(again.status(), 304u);
    EXPECT_EQ(again.body(), "");
    EXPECT_EQ(again.header("ETag"), packed.header("ETag"));
    EXPECT_EQ(ask("GET", "/page/scope.js", "", known).status(), 200u);
}

TEST_F(Page, IsFreeToWhoMayNotLookButNotUnderAForeignName) {
    settings.anonymous = Role::none;
    for (const char* path : {"/", "/page/app.js", "/docs", "/docs/"}) {
        const Reply page = get(path);
        EXPECT_EQ(page.status(), 200u) << path;
        for (const char* of_the_plant : {"floor2", "/dev/"})
            EXPECT_THAT(page.body(), Not(HasSubstr(of_the_plant))) << path;
        EXPECT_EQ(ask("GET", path, "", "Origin: http://evil.example\r\n").status(), 403u);
        Client client = connect();
        client.send(std::string("GET ") + path + " HTTP/1.1\r\nHost: evil.example\r\n\r\n");
        EXPECT_EQ(client.receive().status(), 421u) << path;
    }
    EXPECT_EQ(get("/api/v1/lines").status(), 401u);
    EXPECT_EQ(get("/page/nothing.js").status(), 404u);
}

using Configuration = HttpRig;

TEST_F(Configuration, IsShownWithThePathsAndTheRoleOfWhoAsks) {
    EXPECT_EQ(get("/api/v1/configuration").status(), 404u) << "a program without";
    configuration = [] { return std::string(R"({"lines":[]})"); };
    settings.anonymous = Role::viewer;
    settings.tokens = {{"ops", Role::operator_, hash_of("let-me")}};
    start();
    const Reply mine = get("/api/v1/configuration");
    EXPECT_EQ(status_and(mine, "role version configuration"), R"(200 viewer 1.2.3 {"lines":[]})");
    const auto paths = mine.at("rest").as_array();
    EXPECT_THAT(paths,
                ::testing::Contains(json_of(
                    R"({"method":"GET","path":"/api/v1/lines","role":"viewer","right":"read"})")));
    const Reply theirs =
        ask("GET", "/api/v1/configuration", "", "Authorization: Bearer let-me\r\n");
    EXPECT_EQ(theirs.at("role"), "operator");
    EXPECT_THAT(theirs.body(), Not(HasSubstr("let-me")));
}

}  // namespace
}  // namespace panelgate::web::docs_test
