#include "panelgate/web/http/event_hub.hpp"

#include <gtest/gtest.h>

namespace panelgate::web {
namespace {

TEST(EventHub, GivesEachListenerWhatItWants) {
    EventHub hub;
    hub.publish("point", "{}");
    const auto all = hub.listen({});
    const auto lines = hub.listen({"line"});
    int rung = 0;
    all->wake = [&] { ++rung; };
    hub.publish("point", R"({"a":1})");
    hub.publish("line", R"({"b":2})");
    EXPECT_EQ(rung, 2);
    EXPECT_EQ(lines->take(), "id: 2\nevent: line\ndata: {\"b\":2}\n\n");
    EXPECT_EQ(all->take(),
              "id: 1\nevent: point\ndata: {\"a\":1}\n\n"
              "id: 2\nevent: line\ndata: {\"b\":2}\n\n");
    EXPECT_EQ(all->take(), "");
}

TEST(EventHub, TellsASlowListenerHowMuchItHasLost) {
    EventHub hub;
    const auto slow = hub.listen({});
    for (std::size_t i = 0; i < EventHub::kWaiting + 3; ++i) hub.publish("point", "{}");
    EXPECT_TRUE(slow->take().starts_with("event: lost\ndata: {\"events\":3}\n\nid: 4\n"));
}

TEST(EventHub, IsIdleWhenNobodyListensAndBounded) {
    EventHub hub;
    EXPECT_TRUE(hub.is_idle());
    std::vector<std::shared_ptr<EventHub::Listener>> listeners;
    while (auto listener = hub.listen({})) listeners.push_back(std::move(listener));
    EXPECT_EQ(listeners.size(), EventHub::kListeners);
    hub.end();
    EXPECT_TRUE(listeners[0]->ended());
    listeners.clear();
    EXPECT_TRUE(hub.is_idle());
    EXPECT_TRUE(hub.listen({}));
}

}  // namespace
}  // namespace panelgate::web
