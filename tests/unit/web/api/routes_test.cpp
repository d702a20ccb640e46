#include "http_rig.hpp"

namespace panelgate::web::routes_test {
namespace {

class Access : public HttpRig {
  protected:
    Access() {
        settings.tokens.push_back({"panel", Role::viewer, "see-me"});
        settings.tokens.push_back({"ops", Role::operator_, "let-me"});
        settings.tokens.push_back({"broken", Role::operator_, ""});
    }
    /// Status of a request with this token; "" sends none.
    unsigned status(const std::string& token, const std::string& method, const std::string& target,
                    const std::string& body = "") {
        const std::string header = token.empty() ? "" : "Authorization: Bearer " + token + "\r\n";
        return ask(method, target, body, header).status();
    }
    unsigned read(const std::string& token) { return status(token, "GET", "/api/v1/stations"); }
    unsigned write(const std::string& token) {
        return status(token, "PUT", "/api/v1/stations/press/coils/1", R"({"values":[1]})");
    }
    unsigned broadcast(const std::string& token) {
        return status(token, "POST", "/api/v1/lines/floor1/broadcast",
                      R"({"table":"coils","address":1,"values":[1]})");
    }
    unsigned raw(const std::string& token) {
        return status(token, "POST", "/api/v1/lines/floor1/raw",
                      R"({"station":5,"pdu":"0300010001"})");
    }
};

struct RoleCase {
    Role anonymous;
    const char* token;
    unsigned read;
    unsigned write;  ///< 200: whatever the request returns when it is allowed
};
class AccessMatrix : public Access, public ::testing::WithParamInterface<RoleCase> {};

TEST_P(AccessMatrix, Holds) {
    const RoleCase& c = GetParam();
    settings.anonymous = c.anonymous;
    EXPECT_EQ(read(c.token), c.read);
    EXPECT_EQ(status(c.token, "GET", "/metrics"), c.read);
    EXPECT_EQ(status(c.token, "GET", "/openapi.json"), c.read);
    for (const char* page : {"/", "/page/app.js", "/docs"})
        EXPECT_EQ(status(c.token, "GET", page), 200u) << page << " holds no data";
    EXPECT_EQ(write(c.token), c.write);
    EXPECT_EQ(broadcast(c.token), c.write == 200 ? 202 : c.write);
    EXPECT_EQ(raw(c.token), c.write);
    EXPECT_EQ(status(c.token, "GET", "/healthz"), 200u);
    EXPECT_EQ(status(c.token, "GET", "/readyz"), 200u);
}

INSTANTIATE_TEST_SUITE_P(Roles, AccessMatrix,
                         ::testing::Values(RoleCase{Role::none, "", 401, 401},
                                           RoleCase{Role::none, "see-me", 200, 403},
                                           RoleCase{Role::none, "let-me", 200, 200},
                                           RoleCase{Role::viewer, "", 200, 401},
                                           RoleCase{Role::viewer, "see-me", 200, 403},
                                           RoleCase{Role::viewer, "let-me", 200, 200},
                                           RoleCase{Role::operator_, "", 200, 200},
                                           RoleCase{Role::operator_, "see-me", 200, 403},
                                           RoleCase{Role::operator_, "wrong", 401, 401},
                                           RoleCase{Role::operator_, "let-m", 401, 401},
                                           RoleCase{Role::operator_, "let-melet-me", 401, 401}));

TEST_F(Access, AsksForATokenInTheWayClientsKnow) {
    settings.anonymous = Role::none;
    const Reply reply = get("/api/v1/lines");
    EXPECT_EQ(reply.header("WWW-Authenticate"), "Bearer realm=\"panelgate\"");
    EXPECT_EQ(reply.header("Content-Type"), "application/problem+json");
}

TEST_F(Access, TakesNoOtherSchemeAndNoEmptyToken) {
    for (const char* value : {"Basic bGV0LW1l", "Bearer", "Bearer ", "let-me"}) {
        const Reply reply =
            ask("GET", "/api/v1/lines", "", std::string("Authorization: ") + value + "\r\n");
        EXPECT_EQ(reply.status(), 401u) << value;
    }
    EXPECT_EQ(ask("GET", "/api/v1/lines", "", "Authorization: bearer let-me\r\n").status(), 200u);
}

TEST_F(Access, WhoAsksIsCalledByItsAddressAndItsToken) {
    EXPECT_EQ(write("let-me"), 200u);
    EXPECT_EQ(bus.names[bus.requests.back().client], "http 127.0.0.1 token ops");
    EXPECT_EQ(write(""), 200u);
    EXPECT_EQ(bus.names[bus.requests.back().client], "http 127.0.0.1");
}

TEST_F(Access, KeepsAForeignPageFromWritingThroughABrowser) {
    const char* body = R"({"station":5,"pdu":"0500010000"})";
    const std::string origin = "Origin: http://evil.example\r\nContent-Type: ";
    const auto post = [&](const std::string& headers) {
        return ask("POST", "/api/v1/lines/floor1/raw", body, headers + "\r\n").status();
    };
    EXPECT_EQ(post(origin + "text/plain"), 403u);
    EXPECT_EQ(post(origin + "application/json"), 403u);
    const std::string ours = "Origin: http://x:8080\r\nContent-Type: ";
    EXPECT_EQ(post(ours + "text/plain"), 415u);
    EXPECT_TRUE(bus.requests.empty());
    EXPECT_EQ(post(ours + "application/json"), 200u);
    const Reply preflight =
        ask("OPTIONS", "/api/v1/lines/floor1/raw", "", origin + "text/plain\r\n");
    EXPECT_EQ(preflight.status(), 204u);
    EXPECT_EQ(preflight.header("Access-Control-Allow-Origin"), "");
}

TEST_F(Access, AQueryThatNobodyKnowsIsRefusedOnEveryPath) {
    for (const char* path :
         {"/", "/metrics", "/api/v1/lines", "/api/v1/lines/floor1", "/api/v1/lines/floor1/trace",
          "/api/v1/stations", "/api/v1/stations/press", "/api/v1/events", "/api/v1/relays",
          "/api/v1/stations/press/points", "/api/v1/stations/press/coils/1",
          "/api/v1/stations/press/coils/1/interpretations", "/api/v1/stations/press/devices/UW1"}) {
        const Reply reply = get(std::string(path) + "?cuont=9");
        EXPECT_EQ(reply.status(), 400u) << path;
        EXPECT_EQ(std::string(reply.at("detail").as_string()).substr(0, 21),
                  "unknown query 'cuont'")
            << path;
    }
    EXPECT_EQ(get("/api/v1/stations/press/coils/1?count=1&count=2").at("detail"),
              "the query 'count' is given twice");
    EXPECT_EQ(ask("POST", "/api/v1/lines/floor1/raw?count=1", "{}").status(), 400u);
    EXPECT_TRUE(bus.requests.empty());
}

}  // namespace
}  // namespace panelgate::web::routes_test
