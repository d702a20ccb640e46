#include "panelgate/mqtt/outbox.hpp"

#include <gmock/gmock.h>

#include <map>
#include <string>

#include "mqtt_plant.hpp"

namespace panelgate::mqtt::outbox_test {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

/// A store that carries out what the outbox says.
struct Kept {
    std::map<std::string, std::string> texts{};

    void take(const Outbox::Texts& news) {
        for (const auto& [key, text] : news) {
            if (text.empty())
                texts.erase(key);
            else
                texts[key] = text;
        }
    }
    Outbox::Texts all() const { return {texts.begin(), texts.end()}; }
};

TEST(MqttOutbox, KeepsWhatWaitsUntilTheBrokerHasIt) {
    Publisher publisher({}, small_plant());
    Outbox outbox;
    Kept kept;
    publisher.offer(2, good(*Decimal::parse("21.5")));
    publisher.offer(3, good_number(1));
    kept.take(outbox.next(publisher));
    EXPECT_THAT(kept.texts, SizeIs(2));
    EXPECT_THAT(outbox.next(publisher), IsEmpty()) << "nothing has changed";
    publisher.connected();
    const auto sent = take_all(publisher);
    kept.take(outbox.next(publisher));
    EXPECT_THAT(kept.texts, SizeIs(2)) << "the broker has not acknowledged";
    for (const auto& [message, change] : sent) publisher.delivered(change);
    kept.take(outbox.next(publisher));
    EXPECT_THAT(kept.texts, IsEmpty());
    publisher.offer(3, good_number(2));
    EXPECT_THAT(outbox.next(publisher), IsEmpty()) << "the broker is there";
}

TEST(MqttOutbox, AnotherProgramSendsWhatWaitedWithItsOwnTime) {
    Kept kept;
    {
        Publisher publisher({}, small_plant());
        Outbox outbox;
        publisher.offer(2, good(*Decimal::parse("21.5")));
        publisher.offer(0, station(false, "down: no such device"));
        publisher.offer(4, good(std::string("A7")));
        kept.take(outbox.next(publisher));
    }
    kept.texts["mqtt/00000000000000000099"] = "damaged";
    Publisher publisher({}, small_plant());
    Outbox outbox;
    outbox.restore(publisher, kept.all());
    ASSERT_THAT(publisher.store().entries(), SizeIs(3));
    auto at = publisher.store().entries().begin();
    EXPECT_EQ(at->second.subject, 2U);
    EXPECT_EQ(points::to_string(*at->second.state.value), "21.5");
    EXPECT_EQ(at->second.state.time, kNoon);
    EXPECT_EQ((++at)->second.state.text, "down: no such device");
    EXPECT_EQ((++at)->second.subject, 4U);
    kept.take(outbox.next(publisher));
    kept.take(outbox.next(publisher));
    EXPECT_THAT(kept.texts, SizeIs(3)) << "by their new numbers; the damaged one is forgotten";
}

TEST(MqttOutbox, ATurnIsBounded) {
    Settings settings;
    settings.store = 3 * Outbox::kTurn;
    Publisher publisher(settings, small_plant());
    Outbox outbox;
    for (std::size_t i = 0; i < Outbox::kTurn + 10; ++i)
        publisher.offer(3, good_number(static_cast<std::int64_t>(i)));
    EXPECT_THAT(outbox.next(publisher), SizeIs(Outbox::kTurn));
    EXPECT_THAT(outbox.next(publisher), SizeIs(10));
}

}  // namespace
}  // namespace panelgate::mqtt::outbox_test
