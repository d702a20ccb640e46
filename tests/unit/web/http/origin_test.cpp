#include "origin.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace panelgate::web::origin_test {
namespace {

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
        const auto local = boost::asio::ip::make_address("192.168.1.7");
        const auto refused = check_origin(request, HostNames(settings, {}), local);
        return refused ? refused->status : 0;
    }
    void browse(const char* site, const char* mode, const char* dest) {
        request.headers["sec-fetch-site"] = site;
        request.headers["sec-fetch-mode"] = mode;
        request.headers["sec-fetch-dest"] = dest;
    }
    HttpRequest request;
};

TEST_F(Origin, IsRefusedUnderAForeignName) {
    EXPECT_EQ(refusal(), 0u);
    request.host = "evil.example";
    EXPECT_EQ(refusal(), 421u);
    request.host = "10.0.0.1";
    EXPECT_EQ(refusal(), 421u);
    request.host = "192.168.1.7";
    EXPECT_EQ(refusal(), 0u);
    request.host = "";
    EXPECT_EQ(refusal(), 0u);
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
    for (const char* origin :
         {"http://gateway:8080", "https://GATEWAY", "http://192.168.1.7:8080"}) {
        request.headers["origin"] = origin;
        request.port = "8080";
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
    for (const char* method : {"GET", "HEAD", "PUT", "POST", "OPTIONS"}) {
        request.method = method;
        browse("Cross-Site", "no-cors", "image");
        EXPECT_EQ(refusal(), 403u) << method;
    }
}

TEST_F(Origin, MayBeALinkOfAnotherSiteToAPage) {
    browse("cross-site", "navigate", "document");
    EXPECT_EQ(refusal(), 0u);
    request.path = {"docs"};
    EXPECT_EQ(refusal(), 0u);
    for (const std::vector<std::string>& path :
         {std::vector<std::string>{"api", "v1", "lines"}, {"metrics"}}) {
        request.path = path;
        EXPECT_EQ(refusal(), 403u) << path[0];
    }
    request.path = {};
    request.method = "POST";
    EXPECT_EQ(refusal(), 403u);
    request.method = "GET";
    browse("cross-site", "navigate", "iframe");
    EXPECT_EQ(refusal(), 403u);
}

}  // namespace
}  // namespace panelgate::web::origin_test
