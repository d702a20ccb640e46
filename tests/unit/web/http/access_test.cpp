// Which requests are let in: by token and role, by host name and by the page that they come from.
#include <gtest/gtest.h>

#include <boost/asio/ip/address.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "origin.hpp"
#include "router.hpp"

namespace panelgate::web::access_test {
namespace {

using boost::asio::ip::make_address;
using Headers = std::vector<std::pair<std::string, std::string>>;

Settings with_tokens(Role anonymous) {
    Settings settings;
    settings.anonymous = anonymous;
    settings.tokens.push_back({"panel", Role::viewer, hash_of("see-me")});
    settings.tokens.push_back({"ops", Role::operator_, hash_of("let-me")});
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

TEST(Access, IsByTheRoleOfTheTokenAndWithoutATokenByTheAnonymousOne) {
    using enum Role;
    struct Row {
        const char* authorization;
        Role needed;
        Role anonymous;
        unsigned refused;  ///< 0: allowed
    };
    constexpr Row kRows[] = {
        {"Bearer wrong", none, none, 0},  // a public route needs no token
        {"", viewer, none, 401},          // the anonymous role
        {"", viewer, viewer, 0},
        {"", operator_, viewer, 401},
        {"", operator_, operator_, 0},
        {"Bearer see-me", viewer, none, 0},            // the token's own role,
        {"Bearer see-me", operator_, operator_, 403},  // even where anonymous may do more
        {"Bearer let-me", operator_, none, 0},
        {"Bearer wrong", viewer, operator_, 401},
        {"Bearer let-m", viewer, none, 401},  // a secret whole
        {"Bearer let-mee", viewer, none, 401},
        {"Bearer let-melet-me", viewer, none, 401},
        {"Bearer LET-ME", viewer, none, 401},
        {"Bearer let me", viewer, none, 401},
        {"Bearer ", viewer, none, 401},  // never an empty one
        {"Bearer", viewer, none, 401},
        {"bEARER let-me", operator_, none, 0},  // the scheme without regard to case
        {"Bearer  let-me", operator_, none, 0},
        {"Basic let-me", viewer, none, 401},  // no other scheme
        {"Bearerlet-me", viewer, none, 401},
        {"let-me", viewer, none, 401},
    };
    for (const Row& row : kRows) {
        EXPECT_EQ(refusal(asking(row.authorization), row.needed, row.anonymous), row.refused)
            << '\'' << row.authorization << "' " << label(row.needed) << ' '
            << label(row.anonymous);
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
    const auto without = check_access(asking(""), Role::viewer, with_tokens(Role::none));
    ASSERT_TRUE(without);
    EXPECT_EQ(without->headers, (Headers{{"WWW-Authenticate", "Bearer realm=\"panelgate\""}}));
}

TEST(Access, ReturnsTheRoleOfTheClient) {
    const Settings settings = with_tokens(Role::viewer);
    EXPECT_EQ(standing_of(asking(""), settings).role, Role::viewer);
    EXPECT_EQ(standing_of(asking("Bearer let-me"), settings).role, Role::operator_);
    EXPECT_EQ(standing_of(asking("Bearer see-me"), settings).role, Role::viewer);
    EXPECT_EQ(standing_of(asking("Bearer wrong"), settings).role, Role::none);
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

TEST(Access, TakesNoFormFromAForeignPage) {
    struct Row {
        const char* method;
        const char* content_type;  ///< "": none
        unsigned refused;
    };
    constexpr Row kRows[] = {
        {"POST", "", 415},
        {"POST", "text/plain", 415},
        {"POST", "application/jsonp", 415},
        {"POST", "application/json", 0},
        {"POST", "Application/JSON", 0},
        {"POST", "application/json ; charset=utf-8", 0},
        {"GET", "", 0},     // changes nothing
        {"DELETE", "", 0},  // has no body
    };
    for (const Row& row : kRows) {
        HttpRequest request = asking("", row.method);
        request.headers["origin"] = "http://evil.example";
        if (*row.content_type != '\0') request.headers["content-type"] = row.content_type;
        EXPECT_EQ(refusal(request, Role::operator_, Role::operator_), row.refused)
            << row.method << ' ' << row.content_type;
    }
}

TEST(HostOfAuthority, IsTheNameWithoutItsTrimmings) {
    EXPECT_EQ(host_of_authority("gateway"), "gateway");
    EXPECT_EQ(host_of_authority("Gateway.Plant.Example:8080"), "gateway.plant.example");
    EXPECT_EQ(host_of_authority("gateway."), "gateway");
    EXPECT_EQ(host_of_authority("gateway.:80"), "gateway");
    EXPECT_EQ(host_of_authority("192.168.1.7:"), "192.168.1.7");
    EXPECT_EQ(host_of_authority("[FE80::1]:8080"), "fe80::1");
    EXPECT_EQ(host_of_authority("[::1]"), "::1");
    for (const char* none :
         {"", ":80", ".", "a b", "a/b", "a@b", "a:8o", "a:123456", "a:1:2", "::1", "[::1", "[::1]x",
          "[gateway]", "[]", "a\"b", "\xC3\xA4", "a%20b"})
        EXPECT_EQ(host_of_authority(none), std::nullopt) << none;
    for (const std::string& name : machine_names()) EXPECT_TRUE(host_of_authority(name)) << name;
}

class Names : public ::testing::Test {
  protected:
    bool knows(const char* host, const char* local = "192.168.1.7") const {
        return HostNames(settings, {"Box.plant.example", "box"}).knows(host, make_address(local));
    }
    Settings settings;
};

TEST_F(Names, AreThoseOfTheMachineUnlessOthersAreGiven) {
    EXPECT_TRUE(knows("box"));
    EXPECT_TRUE(knows("box.plant.example"));
    EXPECT_FALSE(knows("gateway.plant.example"));
    settings.hosts = {"Gateway.plant.example"};
    EXPECT_TRUE(knows("gateway.plant.example"));
    for (const char* other : {"box", "plant.example", "evil.gateway.plant.example"})
        EXPECT_FALSE(knows(other)) << other;
}

TEST_F(Names, AreAlwaysTheAddressesThatLeadHereAndTheLoopback) {
    settings.address = "0.0.0.0";
    settings.hosts = {"gateway", "172.16.0.9"};
    EXPECT_TRUE(knows("192.168.1.7"));
    EXPECT_TRUE(knows("192.168.1.7", "::ffff:192.168.1.7"));
    EXPECT_TRUE(knows("fe80::7", "fe80::7%1"));
    EXPECT_TRUE(knows("fe80:0:0::7", "fe80::7"));
    EXPECT_TRUE(knows("172.16.0.9"));
    EXPECT_FALSE(knows("192.168.1.8"));
    EXPECT_FALSE(knows("fe80::8", "fe80::7"));
    settings.address = "10.0.0.1";
    EXPECT_TRUE(knows("10.0.0.1"));
    for (const char* host : {"localhost", "127.0.0.1", "127.0.0.5", "::1", "::ffff:127.0.0.1"})
        EXPECT_TRUE(knows(host)) << host;
    EXPECT_FALSE(knows("localhost.evil.example"));
}

class Origin : public ::testing::Test {
  protected:
    Origin() {
        request.method = "GET";
        request.host = "gateway";
    }
    /// Returns the status of the refusal; 0 if allowed.
    unsigned refusal() const {
        Settings settings;
        settings.hosts = {"gateway"};
        const auto local = make_address("192.168.1.7");
        const auto refused = check_origin(request, HostNames(settings, {}), local, readers);
        return refused ? refused->status : 0;
    }
    void browse(const char* site, const char* mode, const char* dest) {
        request.headers["sec-fetch-site"] = site;
        request.headers["sec-fetch-mode"] = mode;
        request.headers["sec-fetch-dest"] = dest;
    }
    HttpRequest request;
    std::vector<std::string> readers;  ///< http: cors
};

TEST_F(Origin, OfAListedSiteReadsAndChangesNothing) {
    readers = {"https://scada.example"};
    browse("cross-site", "cors", "empty");
    request.headers["origin"] = "https://SCADA.example";
    for (const char* method : {"GET", "HEAD", "OPTIONS"}) {
        request.method = method;
        EXPECT_EQ(refusal(), 0u) << method;
    }
    for (const char* method : {"PUT", "POST", "DELETE"}) {
        request.method = method;
        EXPECT_EQ(refusal(), 403u) << method;
    }
    request.method = "GET";
    request.host = "evil.example";
    EXPECT_EQ(refusal(), 421u) << "a rebound name is not ours";
}

TEST_F(Origin, IsRefusedUnderAForeignName) {
    for (const char* ours : {"gateway", "192.168.1.7", ""}) {
        request.host = ours;
        EXPECT_EQ(refusal(), 0u) << ours;
    }
    request.host = "evil.example";
    EXPECT_EQ(refusal(), 421u);
}

// A container is asked by the address of its machine, which it does not know.
TEST_F(Origin, IsOursUnderTheAddressThatIsAsked) {
    for (const char* address : {"10.0.0.1", "fd00::1"}) {
        request.method = "PUT";
        request.host = address;
        request.port = "8080";
        EXPECT_EQ(refusal(), 0u) << address;
        const bool is_ipv6 = request.host.find(':') != std::string::npos;
        const std::string own = is_ipv6 ? "[fd00::1]" : address;
        request.headers["origin"] = "http://" + own + ":8080";
        EXPECT_EQ(refusal(), 0u) << address;
        for (const std::string& other : {own + ":9999", std::string("10.0.0.2:8080")}) {
            request.headers["origin"] = "http://" + other;
            EXPECT_EQ(refusal(), 403u) << other;
        }
        request.headers.erase("origin");
    }
}

TEST_F(Origin, OfAnotherSiteChangesAndReadsNothing) {
    for (const char* origin :
         {"http://evil.example", "https://evil.example:8080", "null", "gateway"}) {
        request.headers["origin"] = origin;
        for (const char* method : {"PUT", "POST", "DELETE", "GET", "HEAD"}) {
            request.method = method;
            EXPECT_EQ(refusal(), 403u) << method << ' ' << origin;
        }
        request.method = "OPTIONS";
        EXPECT_EQ(refusal(), 0u);
    }
    request.method = "PUT";
    request.port = "8080";
    for (const char* origin :
         {"http://gateway:8080", "https://GATEWAY", "http://192.168.1.7:8080"}) {
        request.headers["origin"] = origin;
        EXPECT_EQ(refusal(), 0u) << origin;
    }
    request.headers["origin"] = "http://localhost:9999";
    EXPECT_EQ(refusal(), 403u) << "another port is another site";
}

TEST_F(Origin, MayBeAPageOfOursAndNoneOfAnotherSite) {
    for (const char* site : {"same-origin", "same-site", "none"}) {
        browse(site, "cors", "empty");
        EXPECT_EQ(refusal(), 0u) << site;
    }
    browse("Cross-Site", "no-cors", "image");
    for (const char* method : {"GET", "HEAD", "PUT", "POST", "OPTIONS"}) {
        request.method = method;
        EXPECT_EQ(refusal(), 403u) << method;
    }
}

TEST_F(Origin, MayBeALinkOfAnotherSiteToAPage) {
    using Path = std::vector<std::string>;
    browse("cross-site", "navigate", "document");
    for (const Path& page : {Path{}, Path{"docs"}}) {
        request.path = page;
        EXPECT_EQ(refusal(), 0u) << page.size();
    }
    for (const Path& data : {Path{"api", "v1", "lines"}, Path{"metrics"}}) {
        request.path = data;
        EXPECT_EQ(refusal(), 403u) << data[0];
    }
    request.path = {};
    request.method = "POST";
    EXPECT_EQ(refusal(), 403u);
    request.method = "GET";
    browse("cross-site", "navigate", "iframe");
    EXPECT_EQ(refusal(), 403u);
}

TEST(Tokens, AreKeptAsHashesWhichAreNoTokens) {
    EXPECT_EQ(hash_of("let-me"),
              "sha256:70bda1fac83224812e277ec4e1c2c121bca3464e1b8d5f7f2fdb6ba70a9ee0c2");
    EXPECT_TRUE(is_token_hash(hash_of("let-me")));
    EXPECT_FALSE(is_token_hash("let-me"));
    EXPECT_FALSE(is_token_hash("sha256:12"));
    EXPECT_EQ(refusal(asking("Bearer " + hash_of("let-me")), Role::viewer, Role::none), 401U);
    EXPECT_EQ(refusal(asking("Bearer "), Role::viewer, Role::none), 401U);
}

TEST(Tokens, AreNotKnownAfterTheirLastDay) {
    Settings settings = with_tokens(Role::none);
    settings.tokens[1].expires = parse_expiry("2027-12-31");
    HttpRequest request = asking("Bearer let-me");
    request.at = *parse_expiry("2027-12-31T23:59:59Z");
    EXPECT_FALSE(check_access(request, Role::operator_, settings));
    EXPECT_EQ(standing_of(request, settings).role, Role::operator_);
    EXPECT_EQ(token_name(request, settings), "ops");
    request.at = *parse_expiry("2028-01-01T00:00:00Z");
    const auto refused = check_access(request, Role::operator_, settings);
    ASSERT_TRUE(refused);
    EXPECT_EQ(refused->status, 401U);
    EXPECT_EQ(standing_of(request, settings).role, Role::none);
    EXPECT_EQ(token_name(request, settings), "");
}

TEST(Tokens, ExpireOnADayOrAtAnInstant) {
    for (const char* text : {"2027-12-31", "2028-02-29", "2027-12-31T18:00:00Z"}) {
        const auto expires = parse_expiry(text);
        ASSERT_TRUE(expires) << text;
        EXPECT_EQ(expiry_text(*expires), text);
    }
    for (const char* text :
         {"", "2027", "2027-13-01", "2027-02-29", "2027-1-1", "31.12.2027", "2027-12-31T24:00:00Z",
          "2027-12-31T18:00:00", "2027-12-31 ", "-027-12-31"})
        EXPECT_FALSE(parse_expiry(text)) << text;
}

}  // namespace
}  // namespace panelgate::web::access_test
