#include <algorithm>
#include <boost/json/array.hpp>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "http_rig.hpp"
#include "page.hpp"
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

std::string word(Role role) {
    if (role == Role::none) return "none";
    return role == Role::viewer ? "viewer" : "operator";
}

TEST(Openapi, HasEveryRouteWithItsRoleAndItsQueriesAndNoOther) {
    Operations open = documented_operations();
    for (const Route& route : routes(std::make_shared<Api>())) {
        const std::pair key{std::string(route.verb), std::string(route.pattern)};
        const auto found = open.find(key);
        ASSERT_NE(found, open.end())
            << key.first << ' ' << key.second << " is not documented in openapi/paths.json";
        EXPECT_EQ(found->second.role, word(route.needed)) << key.second;
        const std::set<std::string> queries(route.queries.begin(), route.queries.end());
        EXPECT_EQ(found->second.queries, queries) << key.first << ' ' << key.second;
        open.erase(found);
    }
    for (const auto& [key, operation] : open)
        ADD_FAILURE() << key.first << ' ' << key.second << " is documented, but there is no route";
}

TEST(Openapi, SaysWhichRoutesHeedWhichHeaders) {
    const Operations all = documented_operations();
    for (const Route& route : routes(std::make_shared<Api>())) {
        const auto& headers = all.at({std::string(route.verb), std::string(route.pattern)}).headers;
        const bool writes =
            route.needed == Role::operator_ && !route.pattern.starts_with("/api/v1/simulator/");
        EXPECT_EQ(headers.contains("Idempotency-Key"), writes) << route.pattern;
    }
}

TEST(DocsPage, ShowsEveryOperationAndEverySchema) {
    const std::string page = docs_page(document());
    const json::object whole = document();
    for (const auto& [path, verbs] : whole.at("paths").as_object()) {
        for (const auto& [verb, operation] : verbs.as_object())
            EXPECT_THAT(page, HasSubstr("id=\"" + text(operation.as_object(), "operationId")));
    }
    for (const auto& [name, schema] : whole.at("components").at("schemas").as_object())
        EXPECT_THAT(page, HasSubstr("id=\"" + std::string(name) + '"'));
}

TEST(DocsPage, NeedsNothingFromElsewhereAndNoScript) {
    const std::string page = docs_page(document());
    EXPECT_THAT(page, Not(HasSubstr("<script")));
    EXPECT_THAT(page, Not(HasSubstr("src=")));
    EXPECT_THAT(page, Not(HasSubstr("http://")));
    EXPECT_THAT(page, Not(HasSubstr("https://")));
}

TEST(DocsPage, WritesTextAsText) {
    const auto odd = json::parse(R"({"info":{"title":"<b>&","version":"1","description":""}})");
    EXPECT_THAT(docs_page(odd.as_object()), HasSubstr("<h1>&lt;b&gt;&amp; 1</h1>"));
}

using ApiDocs = HttpRig;

TEST_F(ApiDocs, AreServedByTheProgramItself) {
    const Reply page = get("/docs");
    EXPECT_EQ(page.status(), 200u);
    EXPECT_EQ(page.header("Content-Type"), "text/html; charset=utf-8");
    EXPECT_THAT(page.header("Content-Security-Policy"), HasSubstr("default-src 'none'"));
    EXPECT_EQ(get("/openapi.json").at("openapi"), "3.1.0");
    EXPECT_EQ(get("/openapi.json").header("Content-Type"), "application/json");
}

}  // namespace
}  // namespace panelgate::web::docs_test
