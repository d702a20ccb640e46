#include "panelgate/web/http/listener.hpp"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "support/http_client.hpp"

namespace panelgate::web::listener_test {
namespace {

using test::Client;

/// Replies with the client's name.
Handling whoami(HttpRequest request) {
    HttpResponse response;
    response.content_type = "text/plain";
    response.body = std::to_string(request.caller->id()) + " " + request.caller->address();
    co_return response;
}

/// A site with a single path, unrelated to panels.
class HttpServer : public ::testing::Test {
  protected:
    HttpServer() {
        auto site = std::make_shared<Site>();
        site->settings.port = 0;
        site->settings.anonymous = Role::none;
        site->settings.hosts = {"x"};
        site->product = "toy/1";
        site->next_caller = [this] { return ++callers; };
        site->routes.push_back({"GET", "/whoami", Role::none, [this](HttpRequest request) {
                                    request.caller->at_leaving(this, [this] { ++left; });
                                    return whoami(std::move(request));
                                }});
        listener = std::make_shared<HttpListener>(io.get_executor(), std::move(site));
        EXPECT_FALSE(listener->open());
    }
    ~HttpServer() override {
        listener->abandon();
        io.poll();
    }

    boost::asio::io_context io;
    std::uint64_t callers = 0;
    int left = 0;
    std::shared_ptr<HttpListener> listener;
};

TEST_F(HttpServer, ServesAnySite) {
    Client client(io, listener->port());
    const test::Reply reply = client.ask("GET", "/whoami");
    EXPECT_EQ(reply.body(), "1 127.0.0.1");
    EXPECT_EQ(reply.header("Server"), "toy/1");
    EXPECT_EQ(reply.header("Content-Type"), "text/plain");
    EXPECT_EQ(client.ask("GET", "/").status(), 404u);
}

TEST_F(HttpServer, NumbersConnectionsAndNotRequests) {
    Client first(io, listener->port());
    EXPECT_EQ(first.ask("GET", "/whoami").body(), "1 127.0.0.1");
    Client second(io, listener->port());
    EXPECT_EQ(second.ask("GET", "/whoami").body(), "2 127.0.0.1");
    EXPECT_EQ(first.ask("GET", "/whoami").body(), "1 127.0.0.1");
    EXPECT_EQ(listener->connections(), 2u);
}

TEST_F(HttpServer, ReportsThatACallerHasLeft) {
    {
        Client client(io, listener->port());
        client.ask("GET", "/whoami");
        EXPECT_EQ(left, 0);
    }
    while (listener->connections() > 0) io.run_one();
    EXPECT_EQ(left, 1);
}

}  // namespace
}  // namespace panelgate::web::listener_test
