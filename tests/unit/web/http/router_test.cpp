#include "router.hpp"

#include <gtest/gtest.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace panelgate::web::router_test {
namespace {

/// Replies with its name and the segments matched by the pattern's {}.
Handling echo(std::string name, HttpRequest request) {
    HttpResponse response;
    response.body = std::move(name);
    for (const std::string& argument : request.arguments) response.body += " " + argument;
    co_return response;
}

class Router : public ::testing::Test {
  protected:
    Router() {
        site.now = [] { return TimePoint{}; };
    }
    void add(const char* verb, const char* pattern, Role needed = Role::none) {
        const std::string name = std::string(verb) + " " + pattern;
        site.routes.push_back({verb, pattern, needed, [name](HttpRequest request) {
                                   return echo(name, std::move(request));
                               }});
    }
    HttpResponse ask(const char* method, std::vector<std::string> path) {
        HttpRequest request;
        request.method = method;
        request.path = std::move(path);
        request.caller = std::make_shared<Caller>(1, "192.0.2.1");
        Shared shared(std::make_shared<Site>(site));
        boost::asio::io_context io;
        HttpResponse got;
        boost::asio::co_spawn(io, dispatch(std::move(request), &shared, barred),
                              [&](std::exception_ptr, HttpResponse made) { got = made; });
        io.run();
        return got;
    }
    Site site;
    std::optional<Problem> barred;
};

TEST_F(Router, TakesTheFirstRouteThatFits) {
    add("GET", "/");
    add("GET", "/a/fixed");
    add("GET", "/a/{}");
    add("GET", "/a/{}/b/{}");
    EXPECT_EQ(ask("GET", {}).body, "GET /");
    EXPECT_EQ(ask("GET", {"a", "fixed"}).body, "GET /a/fixed");
    EXPECT_EQ(ask("GET", {"a", "x/y"}).body, "GET /a/{} x/y");
    EXPECT_EQ(ask("GET", {"a", "x", "b", ""}).body, "GET /a/{}/b/{} x ");
}

TEST_F(Router, KnowsNoPathThatIsShorterOrLonger) {
    add("GET", "/a/{}");
    EXPECT_EQ(ask("GET", {}).status, 404u);
    EXPECT_EQ(ask("GET", {"a"}).status, 404u);
    EXPECT_EQ(ask("GET", {"a", "b", "c"}).status, 404u);
    EXPECT_EQ(ask("GET", {"A", "b"}).status, 404u);
}

TEST_F(Router, AnswersHeadAsGet) {
    add("GET", "/a");
    EXPECT_EQ(ask("HEAD", {"a"}).body, "GET /a");
}

TEST_F(Router, NamesTheMethodsOfAPathEachOnce) {
    add("GET", "/a/{}");
    add("PUT", "/a/{}");
    add("GET", "/{}/b");
    const HttpResponse response = ask("POST", {"a", "b"});
    EXPECT_EQ(response.status, 405u);
    ASSERT_EQ(response.headers.size(), 1u);
    EXPECT_EQ(response.headers[0].first, "Allow");
    EXPECT_EQ(response.headers[0].second, "GET, HEAD, PUT");
}

TEST_F(Router, AsksForTheRoleOfTheRouteAndOnlyThen) {
    site.settings.anonymous = Role::viewer;
    add("GET", "/a", Role::viewer);
    add("PUT", "/a", Role::operator_);
    EXPECT_EQ(ask("GET", {"a"}).status, 200u);
    EXPECT_EQ(ask("PUT", {"a"}).status, 401u);
    EXPECT_EQ(ask("PUT", {"b"}).status, 404u);
}

TEST_F(Router, ReturnsTheMethodsOfAPath) {
    add("GET", "/a/{}", Role::viewer);
    add("PUT", "/a/{}", Role::operator_);
    add("POST", "/b");
    const HttpResponse response = ask("OPTIONS", {"a", "b"});
    EXPECT_EQ(response.status, 204u);
    EXPECT_EQ(response.body, "");
    ASSERT_EQ(response.headers.size(), 1u);
    EXPECT_EQ(response.headers[0].first, "Allow");
    EXPECT_EQ(response.headers[0].second, "GET, HEAD, PUT, OPTIONS");
    EXPECT_EQ(ask("OPTIONS", {"*"}).headers.at(0).second, "GET, HEAD, PUT, POST, OPTIONS");
    EXPECT_EQ(ask("OPTIONS", {"c"}).status, 404u);
}

TEST_F(Router, AnswersABarredClientOnlyProbes) {
    add("GET", "/healthz");
    site.routes.back().probe = true;
    add("GET", "/page");
    add("GET", "/a", Role::viewer);
    barred = problem(503, "no place");
    EXPECT_EQ(ask("GET", {"healthz"}).status, 200u);
    EXPECT_EQ(ask("GET", {"page"}).status, 503u) << "free is not for everybody's name and place";
    for (const char* method : {"GET", "POST", "OPTIONS"}) {
        EXPECT_EQ(ask(method, {"a"}).status, 503u) << method;
        EXPECT_EQ(ask(method, {"nothing"}).status, 503u) << method;
    }
}

}  // namespace
}  // namespace panelgate::web::router_test
