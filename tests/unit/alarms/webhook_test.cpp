#include "panelgate/alarms/webhook.hpp"

#include <gmock/gmock.h>

#include <string>

namespace panelgate::alarms {
namespace {

using testing::HasSubstr;
using testing::Not;

TimePoint at(int seconds) { return TimePoint(std::chrono::seconds(seconds)); }
WallTime wall(int seconds) { return WallTime(std::chrono::seconds(seconds)); }

const Settings& hot() {
    static const Settings kHot{.name = "hot",
                               .station = "oven",
                               .point = "temperature",
                               .above = 80,
                               .severity = "urgent",
                               .text = "Too hot"};
    return kHot;
}
Change change(Change::Kind kind, State state, int second) {
    return {kind, &hot(), {state, wall(second), 81.5, {}}};
}

TEST(Webhook, TellsAlertmanagerWhatIsActiveAgainAndAgainAndItsEndOnce) {
    Webhook hook({.url = "http://a/"});
    EXPECT_FALSE(hook.next(at(0)));
    EXPECT_FALSE(hook.due());
    hook.on_change(change(Change::Kind::raised, State::active, 1));
    EXPECT_EQ(hook.next(at(1)),
              R"([{"labels":{"alertname":"hot","severity":"urgent","station":"oven",)"
              R"("point":"temperature"},"annotations":{"summary":"Too hot","value":"81.5"},)"
              R"("startsAt":"1970-01-01T00:00:01.000000Z"}])");
    hook.settle(at(1), true);
    EXPECT_FALSE(hook.next(at(60)));
    EXPECT_EQ(hook.due(), at(61));
    EXPECT_TRUE(hook.next(at(61)));
    hook.settle(at(61), true);
    hook.on_change(change(Change::Kind::cleared, State::cleared, 70));
    EXPECT_THAT(hook.next(at(70)).value(), HasSubstr(R"("endsAt":"1970-01-01T00:01:10.000000Z")"));
    hook.settle(at(70), false);
    EXPECT_EQ(hook.due(), at(71)) << "an end that was not taken is sent again";
    EXPECT_THAT(hook.next(at(71)).value(), HasSubstr("endsAt"));
    hook.settle(at(71), true);
    EXPECT_FALSE(hook.next(at(1000)));
    EXPECT_FALSE(hook.due());
}

TEST(Webhook, AnAlarmThatComesBackBeforeItsEndWasTakenIsActive) {
    Webhook hook({.url = "http://a/"});
    hook.on_change(change(Change::Kind::raised, State::active, 1));
    hook.next(at(1));
    hook.settle(at(1), true);
    hook.on_change(change(Change::Kind::cleared, State::cleared, 2));
    hook.next(at(2));
    hook.on_change(change(Change::Kind::raised, State::active, 3));  // while the end is under way
    hook.settle(at(3), true);
    EXPECT_THAT(hook.next(at(3)).value(), Not(HasSubstr("endsAt")));
}

TEST(Webhook, WaitsTwiceAsLongAfterEachFailureUpToAMinute) {
    Webhook hook({.url = "http://a/"});
    hook.on_change(change(Change::Kind::raised, State::active, 0));
    int now = 0;
    std::string pauses;
    for (int i = 0; i < 8; ++i) {
        ASSERT_TRUE(hook.next(at(now)));
        hook.settle(at(now), false);
        const auto pause = std::chrono::duration_cast<std::chrono::seconds>(*hook.due() - at(now));
        pauses += std::to_string(pause.count()) + ' ';
        now += static_cast<int>(pause.count());
    }
    EXPECT_EQ(pauses, "1 2 4 8 16 32 60 60 ");
}

TEST(Webhook, TellsEachChangeOnceAsJson) {
    Webhook hook({.url = "http://a/", .format = WebhookSettings::Format::json});
    hook.on_change(change(Change::Kind::raised, State::active, 1));
    hook.on_change(change(Change::Kind::acknowledged, State::acknowledged, 2));
    EXPECT_THAT(hook.next(at(2)).value(), HasSubstr(R"("change":"raised")"));
    hook.settle(at(2), true);
    EXPECT_THAT(hook.next(at(2)).value(), HasSubstr(R"("change":"acknowledged")"));
    hook.settle(at(2), true);
    EXPECT_FALSE(hook.next(at(100)));
    for (std::size_t i = 0; i < Webhook::kWaiting + 5; ++i)
        hook.on_change(change(Change::Kind::raised, State::active, 3));
    EXPECT_EQ(hook.lost(), 5U);
}

TEST(Url, IsTakenApart) {
    const auto url = parse_url("http://alerts.plant:9093/api/v2/alerts?x=1");
    ASSERT_TRUE(url);
    EXPECT_EQ(url->host, "alerts.plant");
    EXPECT_EQ(url->port, 9093);
    EXPECT_EQ(url->path, "/api/v2/alerts?x=1");
    EXPECT_EQ(parse_url("http://[::1]")->host, "::1");
    EXPECT_EQ(parse_url("http://[::1]")->port, 80);
    EXPECT_EQ(parse_url("https://a/b")->port, 443);
    EXPECT_TRUE(parse_url("https://a/b")->secure);
    for (const char* wrong : {"", "alerts:9093", "mailto:a", "http://", "http://a:0", "http://a:x",
                              "http://user@a", "http://a/b c"})
        EXPECT_FALSE(parse_url(wrong)) << wrong;
}

}  // namespace
}  // namespace panelgate::alarms
