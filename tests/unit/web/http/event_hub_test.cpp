#include "panelgate/web/http/event_hub.hpp"

#include <gmock/gmock.h>

#include <memory>
#include <string>
#include <vector>

namespace panelgate::web::event_hub_test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

EventFilter of_type(const std::string& type) {
    EventFilter filter;
    filter.types = {type};
    return filter;
}

/// A hub with epoch "a"; announces each event before publishing it.
class EventHubTest : public testing::Test {
  protected:
    bool tell(EventTopic topic, std::string_view json = "{}") {
        if (!hub.announce(topic.type)) return false;
        hub.publish(std::move(topic), json);
        return true;
    }
    bool tell(const std::string& type, std::string_view json = "{}") {
        return tell(EventTopic{type, "floor1", "press", {}}, json);
    }
    /// Returns a listener whose opening was read.
    std::shared_ptr<EventHub::Listener> listen(EventFilter filter = {}) {
        auto listener = hub.listen(std::move(filter));
        listener->take();
        return listener;
    }

    EventHub hub{"a"};
};

TEST_F(EventHubTest, GivesEachListenerWhatItWants) {
    tell("point");
    const auto all = listen();
    const auto lines = listen(of_type("line"));
    int rung = 0;
    int lines_rung = 0;
    all->wake = [&] { ++rung; };
    lines->wake = [&] { ++lines_rung; };
    tell("point", R"({"a":1})");
    tell("line", R"({"b":2})");
    EXPECT_EQ(rung, 2);
    EXPECT_EQ(lines_rung, 1);
    EXPECT_EQ(lines->take(), "id: a-2\nevent: line\ndata: {\"b\":2}\n\n");
    EXPECT_EQ(all->take(),
              "id: a-1\nevent: point\ndata: {\"a\":1}\n\n"
              "id: a-2\nevent: line\ndata: {\"b\":2}\n\n");
    EXPECT_EQ(all->take(), "");
}

TEST_F(EventHubTest, SendsANewListenerItsPositionAndRetryTime) {
    EXPECT_EQ(hub.listen({})->take(), "retry: 2000\nid: a-0\n\n");
    tell("point");
    EXPECT_EQ(hub.listen({})->take(), "retry: 2000\nid: a-1\n\n");
}

TEST_F(EventHubTest, GivesAReturningListenerWhatItHasMissed) {
    const auto stays = listen();
    for (int i = 0; i < 3; ++i) tell("point");
    EXPECT_EQ(hub.listen({}, "a-1")->take(),
              "retry: 2000\n\n"
              "id: a-2\nevent: point\ndata: {}\n\n"
              "id: a-3\nevent: point\ndata: {}\n\n");
    EXPECT_EQ(hub.listen({}, "a-3")->take(), "retry: 2000\n\n");
}

TEST_F(EventHubTest, KeepsEventsForAReturningListener) {
    listen();
    EXPECT_TRUE(tell("point", R"({"a":1})"));
    EXPECT_THAT(hub.listen({}, "a-0")->take(), HasSubstr(R"(data: {"a":1})"));
}

TEST_F(EventHubTest, MakesNothingWithoutListeners) {
    EXPECT_FALSE(tell("point"));
    listen();
    for (std::size_t i = 0; i < EventHub::kKept; ++i) EXPECT_TRUE(tell("point"));
    EXPECT_FALSE(tell("point"));
    EXPECT_TRUE(tell("station")) << "what is rare is kept for longer";
    // Exactly that many were lost, and reported.
    const auto back = hub.listen(of_type("point"), "a-0");
    EXPECT_EQ(back->take(), "retry: 2000\n\nevent: lost\ndata: {\"events\":" +
                                std::to_string(EventHub::kKept + 1) + ",\"exact\":false}\n\n");
    EXPECT_TRUE(tell("point"));
}

TEST_F(EventHubTest, ReportsToASlowListenerHowMuchItHasLost) {
    const auto slow = listen();
    const auto other = listen(of_type("line"));
    for (std::size_t i = 0; i < EventHub::kKept + 3; ++i) tell("point");
    EXPECT_THAT(slow->take(),
                StartsWith("event: lost\ndata: {\"events\":3,\"exact\":true}\n\nid: a-4\n"));
    EXPECT_EQ(other->take(), "") << "it has lost nothing that it wanted";
}

TEST_F(EventHubTest, KeepsSoManyBytesOfAType) {
    const auto slow = listen();
    const std::string big(EventHub::kKeptBytes / 4, ' ');
    for (int i = 0; i < 6; ++i) tell("point", big);
    EXPECT_THAT(slow->take(), StartsWith("event: lost\ndata: {\"events\":3,"));
    tell("line", std::string(2 * EventHub::kKeptBytes, ' '));
    while (!slow->take().empty()) {
    }
    EXPECT_THAT(hub.listen(of_type("line"), "a-0")->take(), HasSubstr("id: a-7"))
        << "one is kept, however long it is";
}

TEST_F(EventHubTest, AChattyTypeDrivesOutNoRareOne) {
    const auto slow = listen(of_type("station"));
    tell("station");
    for (std::size_t i = 0; i < 2 * EventHub::kKept; ++i) tell("transaction");
    EXPECT_EQ(slow->take(), "id: a-1\nevent: station\ndata: {}\n\n");
}

TEST_F(EventHubTest, ReportsHowMuchIsBeyondTheRing) {
    const auto stays = listen();
    for (std::size_t i = 0; i < EventHub::kKept + 10; ++i) tell("point");
    const std::string text = hub.listen(of_type("point"), "a-2")->take();
    EXPECT_THAT(text, HasSubstr("event: lost\ndata: {\"events\":8,\"exact\":false}\n\nid: a-11\n"));
    EXPECT_THAT(hub.listen(of_type("point"), "a-10")->take(), Not(HasSubstr("lost")));
    EXPECT_THAT(hub.listen(of_type("line"), "a-2")->take(), Not(HasSubstr("lost")));
}

TEST_F(EventHubTest, AnIdOfAnotherLifeIsNotMistaken) {
    const auto stays = listen();
    tell("point");
    tell("point");
    for (const char* id : {"b-1", "1", "a-", "a-x", "a-1x", "a-3", "a-99999999999999999999", "-"}) {
        const std::string text = hub.listen({}, id)->take();
        EXPECT_THAT(text, StartsWith("retry: 2000\n\nevent: lost\ndata: {\"events\":null,"
                                     "\"exact\":false}\n\nid: a-1\n"))
            << id;
    }
}

TEST_F(EventHubTest, FiltersByWhatEventsName) {
    EventFilter filter;
    filter.lines = {"floor1"};
    EXPECT_TRUE(filter.passes({"line", "floor1", "", ""}));
    EXPECT_FALSE(filter.passes({"line", "floor2", "", ""}));
    filter.stations = {{"floor1", "press"}, {"floor1", "9"}};
    EXPECT_TRUE(filter.passes({"station", "floor1", "9", ""}));
    EXPECT_FALSE(filter.passes({"station", "floor2", "9", ""}));
    EXPECT_FALSE(filter.passes({"line", "floor1", "", ""}));
    filter.points = {{"press", "oil"}};
    EXPECT_TRUE(filter.passes({"point", "floor1", "press", "oil"}));
    EXPECT_FALSE(filter.passes({"point", "floor1", "press", "level"}));
    EXPECT_FALSE(filter.passes({"station", "floor1", "press", ""}));
}

TEST_F(EventHubTest, AHeartbeatMovesThePlaceToComeBackTo) {
    const auto lines = listen(of_type("line"));
    tell("point");
    EXPECT_EQ(lines->heartbeat(), ": \nid: a-1\n\n");
    tell("line");
    EXPECT_THAT(lines->heartbeat(), HasSubstr("event: line")) << "nothing is passed over";
}

TEST_F(EventHubTest, HandsOutMuchInPieces) {
    const auto listener = listen();
    const std::string some(1000, ' ');
    for (int i = 0; i < 200; ++i) tell("point", some);
    const std::string first = listener->take();
    EXPECT_LT(first.size(), EventHub::kTakeBytes + 2000);
    std::string all = first;
    for (std::string more = listener->take(); !more.empty(); more = listener->take()) all += more;
    EXPECT_THAT(all, HasSubstr("id: a-200\n"));
}

TEST_F(EventHubTest, ALongWayWithoutAnythingWantedIsGoneInPieces) {
    const auto stays = listen();
    EventFilter of_oven;
    of_oven.stations = {{"floor1", "oven"}};
    for (std::size_t i = 0; i < 2 * EventHub::kTakeExamined; ++i) tell("point");
    tell(EventTopic{"point", "floor1", "oven", ""});
    const auto back = hub.listen(of_oven, "a-0");
    EXPECT_EQ(back->take(), "retry: 2000\n\n");
    EXPECT_EQ(back->take(), ": \n\n") << "there is more, and others have had their turn";
    EXPECT_THAT(back->take(), HasSubstr("event: point"));
    EXPECT_EQ(back->take(), "");
}

TEST_F(EventHubTest, HasRoomForSomeListenersAndSendsThemHomeAtTheEnd) {
    std::vector<std::shared_ptr<EventHub::Listener>> listeners;
    while (auto listener = hub.listen({})) listeners.push_back(std::move(listener));
    EXPECT_EQ(listeners.size(), EventHub::kListeners);
    int rung = 0;
    listeners[0]->wake = [&] { ++rung; };
    hub.end();
    EXPECT_TRUE(listeners[0]->ended());
    EXPECT_EQ(rung, 1);
    listeners.clear();
    EXPECT_TRUE(hub.listen({}));
}

TEST_F(EventHubTest, AListenerMayOutliveTheHub) {
    auto own = std::make_unique<EventHub>("b");
    const auto listener = own->listen({});
    own.reset();
    EXPECT_THAT(listener->take(), HasSubstr("retry"));
    EXPECT_EQ(listener->take(), "");
    EXPECT_EQ(listener->heartbeat(), ": \n\n");
}

}  // namespace
}  // namespace panelgate::web::event_hub_test
