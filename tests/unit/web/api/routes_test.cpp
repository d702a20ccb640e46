// Who may use a route, and what each answer has besides its handler's.
#include <string>

#include "answer.hpp"
#include "http_rig.hpp"

namespace panelgate::web::routes_test {
namespace {

using ::testing::StartsWith;

constexpr const char* kRaw = "/api/v1/lines/floor1/raw";

class Access : public HttpRig {
  protected:
    Access() {
        settings.tokens.push_back({"panel", Role::viewer, hash_of("see-me")});
        settings.tokens.push_back({"ops", Role::operator_, hash_of("let-me")});
        settings.tokens.push_back({"lab", Role::engineer, hash_of("make-me")});
        settings.tokens.push_back({"boss", Role::admin, hash_of("trust-me")});
        settings.tokens.push_back({"broken", Role::operator_, ""});
    }
    /// Status of a request with this token; "" sends none.
    unsigned status(const std::string& token, const std::string& method, const std::string& target,
                    const std::string& body = "") {
        const std::string header = token.empty() ? "" : "Authorization: Bearer " + token + "\r\n";
        return ask(method, target, body, header).status();
    }
    unsigned write(const std::string& token) {
        return status(token, "PUT", "/api/v1/stations/press/coils/1", R"({"values":[1]})");
    }
};

TEST_F(Access, IsByRoles) {
    struct Row {
        Role anonymous;
        const char* token;
        unsigned read;
        unsigned write;
        unsigned engineer;  ///< raw and broadcast
        unsigned reload;
    };
    // This server has nothing to reload: 409 is as far as one may come.
    constexpr Row kRows[] = {
        {Role::none, "", 401, 401, 401, 401},
        {Role::none, "see-me", 200, 403, 403, 403},
        {Role::none, "let-me", 200, 200, 403, 403},
        {Role::none, "make-me", 200, 200, 200, 403},
        {Role::none, "trust-me", 200, 200, 200, 409},
        {Role::viewer, "", 200, 401, 401, 401},
        {Role::viewer, "see-me", 200, 403, 403, 403},
        {Role::operator_, "", 200, 200, 401, 401},
        {Role::operator_, "see-me", 200, 403, 403, 403},
        {Role::operator_, "wrong", 401, 401, 401, 401},
        {Role::engineer, "", 200, 200, 200, 401},
        {Role::admin, "", 200, 200, 200, 409},
    };
    const char* broadcast = R"({"table":"coils","address":1,"values":[1]})";
    for (const Row& row : kRows) {
        SCOPED_TRACE(std::string(label(row.anonymous)) + ' ' + row.token);
        settings.anonymous = row.anonymous;
        start();
        for (const char* path : {"/api/v1/stations", "/metrics", "/openapi.json"})
            EXPECT_EQ(status(row.token, "GET", path), row.read) << path;
        for (const char* path : {"/", "/page/app.js", "/docs", "/healthz", "/readyz"})
            EXPECT_EQ(status(row.token, "GET", path), 200u) << path << " holds no data";
        EXPECT_EQ(write(row.token), row.write);
        EXPECT_EQ(status(row.token, "POST", "/api/v1/lines/floor1/broadcast", broadcast),
                  row.engineer == 200 ? 202u : row.engineer);
        EXPECT_EQ(status(row.token, "POST", kRaw, R"({"station":5,"pdu":"0300010001"})"),
                  row.engineer);
        EXPECT_EQ(status(row.token, "POST", "/api/v1/reload"), row.reload);
    }
}

TEST_F(Access, WhoAsksIsCalledByItsAddressAndItsToken) {
    EXPECT_EQ(write("let-me"), 200u);
    EXPECT_EQ(bus.names[bus.requests.back().client], "http 127.0.0.1 token ops");
    EXPECT_EQ(write(""), 200u);
    EXPECT_EQ(bus.names[bus.requests.back().client], "http 127.0.0.1");
}

TEST_F(Access, KeepsAForeignPageFromWritingThroughABrowser) {
    const std::string foreign = "Origin: http://evil.example\r\nContent-Type: ";
    const auto post = [&](const std::string& headers) {
        const char* body = R"({"station":5,"pdu":"0500010000"})";
        return ask("POST", kRaw, body, headers + "\r\n").status();
    };
    EXPECT_EQ(post(foreign + "text/plain"), 403u);
    EXPECT_EQ(post(foreign + "application/json"), 403u);
    const std::string ours = "Origin: http://x:8080\r\nContent-Type: ";
    EXPECT_EQ(post(ours + "text/plain"), 415u);
    EXPECT_TRUE(bus.requests.empty());
    EXPECT_EQ(post(ours + "application/json"), 200u);
    const Reply preflight = ask("OPTIONS", kRaw, "", foreign + "text/plain\r\n");
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
        EXPECT_THAT(detail_of(reply), StartsWith("unknown query 'cuont'")) << path;
    }
    EXPECT_EQ(get("/api/v1/stations/press/coils/1?count=1&count=2").at("detail"),
              "the query 'count' is given twice");
    EXPECT_EQ(ask("POST", std::string(kRaw) + "?count=1", "{}").status(), 400u);
    EXPECT_TRUE(bus.requests.empty());
}

TEST(Tag, DoesNotCountWhatOnlyTimeChanges) {
    EXPECT_EQ(tag_of(R"({"a":1,"age_ms":5})"), tag_of(R"({"a":1,"age_ms":17})"));
    EXPECT_NE(tag_of(R"({"a":1,"age_ms":5})"), tag_of(R"({"a":2,"age_ms":5})"));
    EXPECT_NE(tag_of(R"({"a":1,"age_ms":5,"b":1})"), tag_of(R"({"a":1,"age_ms":5,"b":2})"));
    EXPECT_NE(tag_of(R"({"every_ms":1000})"), tag_of(R"({"every_ms":7000})")) << "configured";
    EXPECT_NE(tag_of(R"({"max_age_ms":1})"), tag_of(R"({"max_age_ms":7})")) << "configured";
    EXPECT_THAT(tag_of(""), StartsWith("W/\""));
    const auto is_known = [](const char* if_none_match) {
        HttpResponse response;
        return add_etag(response, if_none_match, "W/\"7\"") && response.status == 304;
    };
    for (const char* named : {"W/\"7\"", "\"7\"", "\"6\", W/\"7\", \"8\"", "*"})
        EXPECT_TRUE(is_known(named)) << named << ", strong or weak, in a list";
    for (const char* other : {"", "\"77\""}) EXPECT_FALSE(is_known(other)) << other;
}

using ApiManners = HttpRig;

TEST_F(ApiManners, P10StatusThatHasNotChangedIsNotSentAgain) {
    bus.stations[31].last_success = 5ms;
    const Reply first = get("/api/v1/stations");
    const std::string tag = first.header("ETag");
    bus.stations[31].last_success = 80ms;
    const Reply same = ask("GET", "/api/v1/stations", "", "If-None-Match: " + tag + "\r\n");
    EXPECT_EQ(same.status(), 304u);
    EXPECT_EQ(same.header("ETag"), tag);
    EXPECT_EQ(same.body(), "");
    bus.stations[31].state = Health::offline;
    const Reply other = ask("GET", "/api/v1/stations", "", "If-None-Match: " + tag + "\r\n");
    EXPECT_EQ(other.status(), 200u);
    EXPECT_NE(other.header("ETag"), tag);
    EXPECT_EQ(get("/api/v1/stations/press/coils/1").header("ETag"), "");
}

TEST_F(ApiManners, WhatIsLongerThanAPacketIsPackedForWhoeverTakesIt) {
    const std::string path = "/api/v1/stations/floor1:9/holding-registers/0?count=";
    const Reply packed = ask("GET", path + "2000", "", "Accept-Encoding: gzip\r\n");
    EXPECT_EQ(packed.header("Content-Encoding"), "gzip");
    EXPECT_EQ(packed.header("Vary"), "Accept-Encoding");
    EXPECT_THAT(packed.body(), StartsWith("\x1f\x8b"));
    const Reply plain = get(path + "2000");
    EXPECT_EQ(plain.header("Content-Encoding"), "");
    EXPECT_EQ(plain.header("Vary"), "Accept-Encoding");
    EXPECT_LT(packed.body().size() * 2, plain.body().size());
    const Reply small = ask("GET", path + "2", "", "Accept-Encoding: gzip\r\n");
    EXPECT_EQ(small.header("Content-Encoding"), "");
}

TEST_F(ApiManners, EveryPathTellsWhatItUnderstandsAndNothingToOtherSites) {
    struct Row {
        const char* method;
        const char* path;
        unsigned status;
        const char* allow;
    };
    constexpr Row kRows[] = {
        {"OPTIONS", "/api/v1/stations/press/devices/UW1", 204, "GET, HEAD, PUT, OPTIONS"},
        {"OPTIONS", "/api/v1/read", 204, "POST, OPTIONS"},
        {"OPTIONS", "/openapi.json", 204, "GET, HEAD, OPTIONS"},
        {"OPTIONS", "*", 204, "GET, HEAD, PUT, POST, DELETE, OPTIONS"},
        {"POST", "/api/v1/stations", 405, "GET, HEAD"},
        {"DELETE", "/api/v1/stations/press/coils/1", 405, "GET, HEAD, PUT"},
        {"GET", kRaw, 405, "POST"},
        {"GET", "/nothing", 404, ""},
        {"GET", "/api/v1/stations/press/coils", 404, ""},
        {"GET", "/api/v1/stations/press/coils/1/2", 404, ""},
        {"GET", "/%zz", 400, ""},
        {"GET", "*", 400, ""},
        {"GET", "/api/v1/stations/", 200, ""},
    };
    for (const Row& row : kRows) {
        SCOPED_TRACE(std::string(row.method) + ' ' + row.path);
        const Reply reply = ask(row.method, row.path);
        EXPECT_EQ(reply.status(), row.status);
        EXPECT_EQ(reply.header("Allow"), row.allow);
        EXPECT_EQ(reply.header("Access-Control-Allow-Origin"), "");
        EXPECT_EQ(reply.header("Content-Length").empty(), row.status == 204);
    }
}

}  // namespace
}  // namespace panelgate::web::routes_test
