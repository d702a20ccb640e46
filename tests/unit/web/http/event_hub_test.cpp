#include "panelgate/web/http/event_hub.hpp"

#include <gmock/gmock.h>

#include <boost/asio/io_context.hpp>
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
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

/// A hub with epoch "a"; events are published while they are wanted.
class EventHubTest : public testing::Test {
  protected:
    bool tell(EventTopic topic, std::string_view json = "{}") {
        if (!hub.is_wanted()) return false;
        hub.publish(std::move(topic), json);
        return true;
    }
    bool tell(const std::string& type, std::string_view json = "{}") {
        return tell(EventTopic{type, "floor1", "press", {}}, json);
    }
    void tell_points(std::size_t count, std::string_view json = "{}") {
        for (std::size_t i = 0; i < count; ++i) tell("point", json);
    }
    /// Returns a listener whose opening was read.
    std::shared_ptr<EventHub::Listener> listen(EventFilter filter = {}) {
        auto listener = hub.listen(std::move(filter));
        listener->take();
        return listener;
    }
    /// What a listener for this type gets that comes back with this id.
    std::string taken(const std::string& type, std::string_view last_id) {
        return hub.listen(of_type(type), last_id)->take();
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

TEST_F(EventHubTest, GivesANewListenerItsPositionAndAReturningOneWhatItHasMissed) {
    EXPECT_EQ(hub.listen({})->take(), "retry: 2000\nid: a-0\n\n");
    tell("point", R"({"a":1})");
    EXPECT_THAT(hub.listen({}, "a-0")->take(), HasSubstr(R"(data: {"a":1})")) << "nobody listened";
    EXPECT_EQ(hub.listen({})->take(), "retry: 2000\nid: a-1\n\n");
    tell_points(2);
    EXPECT_EQ(hub.listen({}, "a-1")->take(),
              "retry: 2000\n\n"
              "id: a-2\nevent: point\ndata: {}\n\n"
              "id: a-3\nevent: point\ndata: {}\n\n");
    EXPECT_EQ(hub.listen({}, "a-3")->take(), "retry: 2000\n\n");
}

TEST_F(EventHubTest, MakesNothingWithoutListeners) {
    EXPECT_FALSE(tell("point"));
    listen();
    for (std::size_t i = 0; i < EventHub::kKept; ++i) EXPECT_TRUE(tell("point"));
    EXPECT_THAT(hub.listen(of_type("point"), "a-0")->take(), Not(HasSubstr("lost")));
    for (std::size_t i = 0; i <= EventHub::kKept; ++i) EXPECT_TRUE(tell("point"));
    EXPECT_FALSE(tell("point")) << "nobody has come back";
    const auto back = hub.listen(of_type("point"), "a-1");
    EXPECT_EQ(back->take(),
              "retry: 2000\n\nevent: lost\ndata: {\"events\":null,\"exact\":false}\n\n");
    EXPECT_TRUE(tell("point", "1"));
    EXPECT_EQ(back->take(), "id: a.1-1\nevent: point\ndata: 1\n\n");
}

TEST_F(EventHubTest, EventsThatFoundNoWayAreLostToAll) {
    const auto listener = listen();
    hub.lose(3);
    tell("point");
    EXPECT_THAT(listener->take(), StartsWith("event: lost\ndata: {\"events\":3,\"exact\":true}"));
}

TEST(EventOutlet, PostsToTheHubsLoopAndDropsWhatWaitsTooLong) {
    boost::asio::io_context faces;
    const auto hub = std::make_shared<EventHub>("a");
    EventOutlet outlet(hub, faces.get_executor());
    EXPECT_FALSE(outlet.is_wanted());
    const auto listener = hub->listen(of_type("line"));
    listener->take();
    for (std::size_t i = 0; i < EventOutlet::kWaiting + 2; ++i)
        outlet.publish({"point", "floor1", {}, {}}, "{}");
    EXPECT_EQ(listener->take(), "") << "nothing crosses before that loop runs";
    faces.run();
    outlet.publish({"line", "floor1", {}, {}}, "{}");
    faces.restart();
    faces.run();
    const std::string number = std::to_string(EventOutlet::kWaiting + 1);
    EXPECT_EQ(listener->take(), "event: lost\ndata: {\"events\":2,\"exact\":true}\n\nid: a-" +
                                    number + "\nevent: line\ndata: {}\n\n");
    outlet.end();
    faces.restart();
    faces.run();
    EXPECT_TRUE(listener->ended());
}

TEST_F(EventHubTest, ReportsToASlowListenerHowMuchItHasLost) {
    const auto slow = listen();
    const auto other = listen(of_type("line"));
    tell_points(EventHub::kKept + 3);
    EXPECT_THAT(slow->take(),
                StartsWith("event: lost\ndata: {\"events\":3,\"exact\":true}\n\nid: a-4\n"));
    EXPECT_EQ(other->take(), "") << "it has lost nothing that it wanted";
}

TEST_F(EventHubTest, KeepsSoManyBytesOfAType) {
    const auto slow = listen();
    tell_points(6, std::string(EventHub::kKeptBytes / 4, ' '));
    EXPECT_THAT(slow->take(), StartsWith("event: lost\ndata: {\"events\":3,"));
    tell("line", std::string(2 * EventHub::kKeptBytes, ' '));
    while (!slow->take().empty()) {
    }
    EXPECT_THAT(taken("line", "a-0"), HasSubstr("id: a-7")) << "one is kept, however long it is";
}

TEST_F(EventHubTest, AChattyTypeDrivesOutNoRareOne) {
    const auto slow = listen(of_type("station"));
    tell("station");
    for (std::size_t i = 0; i < 2 * EventHub::kKept; ++i) tell("transaction");
    EXPECT_EQ(slow->take(), "id: a-1\nevent: station\ndata: {}\n\n");
}

TEST_F(EventHubTest, ReportsHowMuchIsBeyondTheRing) {
    const auto stays = listen();
    tell_points(EventHub::kKept + 10);
    EXPECT_THAT(taken("point", "a-2"),
                HasSubstr("event: lost\ndata: {\"events\":8,\"exact\":false}\n\nid: a-11\n"));
    EXPECT_THAT(taken("point", "a-10"), Not(HasSubstr("lost")));
    EXPECT_THAT(taken("line", "a-2"), Not(HasSubstr("lost")));
}

TEST_F(EventHubTest, AnIdOfAnotherLifeIsNotMistaken) {
    const auto stays = listen();
    tell_points(2);
    for (const char* id : {"b-1", "1", "a-", "a-x", "a-1x", "a-3", "a-99999999999999999999", "-"}) {
        EXPECT_THAT(hub.listen({}, id)->take(),
                    StartsWith("retry: 2000\n\nevent: lost\ndata: {\"events\":null,"
                               "\"exact\":false}\n\nid: a-1\n"))
            << id;
    }
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
    tell_points(200, std::string(1000, ' '));
    std::string all = listener->take();
    EXPECT_LT(all.size(), EventHub::kTakeBytes + 2000);
    for (std::string more = listener->take(); !more.empty(); more = listener->take()) all += more;
    EXPECT_THAT(all, HasSubstr("id: a-200\n"));
}

TEST_F(EventHubTest, ALongWayWithoutAnythingWantedIsGoneInPieces) {
    const auto stays = listen();
    EventFilter of_oven;
    of_oven.stations = {{"floor1", "oven"}};
    tell_points(2 * EventHub::kTakeExamined);
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
