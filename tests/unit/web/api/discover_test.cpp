#include <string>
#include <vector>

#include "http_rig.hpp"

namespace panelgate::web::discover_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using State = DiscoveryReport::State;

class FakeDiscovery final : public DiscoverySource {
  public:
    std::optional<std::string> start(std::string_view line, std::string_view stations,
                                     unsigned share) override {
        if (stations == "x") return "is not a list";
        begun.push_back(std::string(line) + ' ' + std::string(stations) + ' ' +
                        std::to_string(share));
        told.state = State::running;
        return std::nullopt;
    }
    void stop(std::string_view) override { told.state = State::stopped; }
    DiscoveryReport report(std::string_view) const override { return told; }

    DiscoveryReport told;
    std::vector<std::string> begun;
};

class ApiDiscover : public HttpRig {
  protected:
    ApiDiscover() { discovery = &source; }
    Reply post(const std::string& body, const std::string& headers = "") {
        return ask("POST", kPath, body, headers);
    }

    static constexpr const char* kPath = "/api/v1/lines/floor1/discover";
    FakeDiscovery source;
};

TEST_F(ApiDiscover, BeginsWithAllAddressesAndATenthOfTheLine) {
    const Reply reply = post("");
    EXPECT_EQ(reply.status(), 202u);
    EXPECT_EQ(reply.at("state"), "running");
    EXPECT_THAT(source.begun, ElementsAre("floor1 1-247 10"));
}

TEST_F(ApiDiscover, TakesAListAndAShare) {
    EXPECT_EQ(post(R"({"stations": "5,7-9", "share_percent": 50})").status(), 202u);
    EXPECT_THAT(source.begun, ElementsAre("floor1 5,7-9 50"));
}

TEST_F(ApiDiscover, TellsWhatWasFound) {
    source.told.state = State::done;
    source.told.share_percent = 10;
    source.told.asked = source.told.of = 245;
    source.told.stations = {{9, {"panasonic-gt", "omron-cp2e"}, "9 of 9 reads"}};
    source.told.yaml = "      - {id: 9}\n";
    source.told.bus = 9800ms;
    source.told.took = 98s;
    EXPECT_EQ(
        get(kPath).body(),
        R"({"line":"floor1","state":"done","share_percent":10,"asked":245,"refused":0,"of":245,)"
        R"("found":1,"bus_ms":9800,"took_ms":98000,"stations":[{"id":9,)"
        R"("profiles":["panasonic-gt","omron-cp2e"],"evidence":"9 of 9 reads"}],)"
        R"("yaml":"      - {id: 9}\n"})"
        "\n");
    source.told = {};
    EXPECT_EQ(get(kPath).at("state"), "never");
}

TEST_F(ApiDiscover, IsOneAtATimeOnALine) {
    post("");
    const Reply second = post("");
    EXPECT_EQ(second.status(), 409u);
    EXPECT_THAT(second.body(), HasSubstr("already"));
    EXPECT_EQ(source.begun.size(), 1u);
    EXPECT_EQ(ask("DELETE", kPath).at("state"), "stopped");
    EXPECT_EQ(post("").status(), 202u);
}

TEST_F(ApiDiscover, WithAKeyIsBegunOnce) {
    const std::string key = "Idempotency-Key: k1\r\n";
    EXPECT_EQ(post("", key).status(), 202u);
    source.told.state = State::done;
    const Reply again = post("", key);
    EXPECT_EQ(again.status(), 202u);
    EXPECT_EQ(again.header("Idempotency-Replayed"), "true");
    EXPECT_EQ(source.begun.size(), 1u);
}

TEST_F(ApiDiscover, RefusesWhatMakesNoSense) {
    EXPECT_EQ(post(R"({"stations": "x"})").status(), 400u);
    EXPECT_EQ(post(R"({"stations": 5})").status(), 400u);
    EXPECT_EQ(post(R"({"share_percent": 0})").status(), 400u);
    EXPECT_EQ(post(R"({"share_percent": 51})").status(), 400u);
    EXPECT_EQ(post(R"({"station": "5"})").status(), 400u);
    EXPECT_EQ(post("[]").status(), 400u);
    EXPECT_EQ(ask("POST", "/api/v1/lines/attic/discover").status(), 404u);
    EXPECT_EQ(get("/api/v1/lines/attic/discover").status(), 404u);
    EXPECT_EQ(ask("DELETE", "/api/v1/lines/attic/discover").status(), 404u);
    EXPECT_TRUE(source.begun.empty());
}

TEST_F(ApiDiscover, IsForOperators) {
    settings.anonymous = Role::viewer;
    EXPECT_EQ(post("").status(), 401u) << "there may be a token for that";
    EXPECT_EQ(ask("DELETE", kPath).status(), 401u);
    EXPECT_EQ(get(kPath).status(), 200u);
}

TEST_F(ApiDiscover, NeedsALineThatIsUp) {
    bus.line.up = false;
    bus.line.state = "down: cannot open /dev/x";
    const Reply reply = post("");
    EXPECT_EQ(reply.status(), 502u);
    EXPECT_THAT(reply.body(), HasSubstr("the line is down: cannot open /dev/x"));
    EXPECT_TRUE(source.begun.empty());
}

}  // namespace
}  // namespace panelgate::web::discover_test
