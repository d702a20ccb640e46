// A master with other slaves on its line, noise, retries and slow panels behind the gateway, in
// virtual time: every reply it accepts must be the answer to its request.
#include <gmock/gmock.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <random>
#include <utility>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "talk.hpp"

namespace panelgate::serial_server::test::world_test {
namespace {

struct Faults {
    unsigned damage_percent = 0;  ///< of the master's frames
    bool echo = false;
    bool tells_timeout = false;
};

class World {
  public:
    World(unsigned seed, Faults faults)
        : random_(seed), faults_(faults), conversation_(settings()) {}

    void run(int exchanges) {
        for (int i = 0; i < exchanges; ++i) {
            if (chance(15)) {
                hear_others();
            } else if (chance(5)) {
                say(modbus::encode_adu(0, modbus::encode_write_register(1, 2)));
            } else {
                ask_and_wait();
            }
            pass(10ms + 1ms * number(40));
        }
        pass(2s);
    }

    int right = 0;
    int wrong = 0;        ///< wrongly accepted replies
    int interrupted = 0;  ///< sent while the master was transmitting, or before silence
    int retries = 0;

  private:
    Settings settings() const {
        Settings made = Talk::rtu(EchoMode::automatic);
        if (faults_.tells_timeout) made.response_timeout = kTimeout;
        return made;
    }
    bool chance(unsigned percent) { return random_() % 100 < percent; }
    int number(int below) { return static_cast<int>(random_() % static_cast<unsigned>(below)); }

    void ask_and_wait() {
        const auto address = static_cast<std::uint16_t>(random_() % 50);
        const auto unit = static_cast<std::uint8_t>(kOurs + random_() % 2);
        const Bytes pdu = chance(30)
                              ? modbus::encode_write_register(address, 7)
                              : modbus::encode_read(modbus::Table::holding_registers, address, 1);
        for (int attempt = 0; attempt < 3; ++attempt) {
            retries += attempt > 0 ? 1 : 0;
            say(modbus::encode_adu(unit, pdu));
            if (hears_answer(unit, pdu)) return;
        }
    }

    /// A reply of a slave unrelated to the gateway; its values may look like requests.
    void hear_others() {
        say(modbus::encode_adu(kOther, kReadOne));
        pass(5ms);
        say(modbus::encode_adu(kOther, joined({{3, 8}, kRequest})));
    }

    /// Delivers it as an adapter would.
    void say(Bytes frame) {
        if (chance(faults_.damage_percent)) {
            const std::size_t at = random_() % frame.size();
            if (chance(50)) {
                frame[at] ^= static_cast<std::uint8_t>(1u << random_() % 8);
            } else {
                frame.erase(frame.begin() + static_cast<std::ptrdiff_t>(at));
            }
        }
        const std::size_t piece = 1 + random_() % 8;
        while (!frame.empty()) {
            const Bytes part = take_first(frame, piece);
            pass(wire_time(Talk::rtu().device.serial, part.size()));
            conversation_.hear(part);
            talking_ = true;
        }
        talking_ = false;
        silent_since_ = conversation_.now;
        if (chance(10)) conversation_.hear({0x00});
    }

    bool hears_answer(std::uint8_t unit, const Bytes& pdu) {
        const TimePoint until = conversation_.now + kTimeout;
        const std::size_t before = conversation_.sent.size();
        while (conversation_.now < until && conversation_.sent.size() == before) pass(1ms);
        if (conversation_.sent.size() == before) return false;
        const auto frame = modbus::decode_adu(conversation_.sent.back());
        if (frame->station != unit || !modbus::answers(pdu, frame->pdu)) return false;
        const bool is_write = pdu[0] == modbus::kWriteSingleRegister;
        const bool is_it = is_write || frame->pdu[3] == pdu[2];
        ++(is_it ? right : wrong);
        return true;
    }

    void pass(Duration by) {
        const TimePoint end = conversation_.now + by;
        while (conversation_.now < end) {
            conversation_.pass(std::min<Duration>(1ms, end - conversation_.now));
            serve();
        }
    }

    /// The panels behind the gateway: each register holds its address.
    void serve() {
        for (; seen_ < conversation_.asks.size(); ++seen_)
            panel_.push_back(
                {conversation_.now + 1ms * (1 + number(350)), conversation_.asks[seen_]});
        while (!panel_.empty() && panel_.front().first <= conversation_.now) {
            const Ask ask = panel_.front().second;
            panel_.pop_front();
            const Bytes& pdu = ask.adu.pdu;
            const bool is_write = pdu[0] == modbus::kWriteSingleRegister;
            conversation_.answer_to(ask.ticket, is_write ? pdu : Bytes{pdu[0], 2, 0, pdu[2]});
        }
        for (; judged_ < conversation_.sent.size(); ++judged_) {
            const bool too_early = conversation_.sent_at[judged_] < silent_since_ + kSilence;
            interrupted += talking_ || too_early ? 1 : 0;
            if (faults_.echo) conversation_.hear(conversation_.sent[judged_]);
        }
    }

    static constexpr Duration kTimeout = 250ms;
    const Duration kSilence = silent_interval(Talk::rtu().device.serial);
    std::mt19937 random_;
    Faults faults_;
    Talk conversation_;
    std::deque<std::pair<TimePoint, Ask>> panel_;
    std::size_t seen_ = 0;
    std::size_t judged_ = 0;
    bool talking_ = false;
    TimePoint silent_since_{};
};

TEST(World, OfAMasterThatIsHeardWell) {
    World world(1, {.tells_timeout = true});
    world.run(5000);
    EXPECT_EQ(world.wrong, 0);
    EXPECT_EQ(world.interrupted, 0);
    EXPECT_GT(world.right, 3000);
}

TEST(World, OfAMasterThatIsHeardBadly) {
    for (unsigned seed = 1; seed <= 10; ++seed) {
        World world(seed,
                    {.damage_percent = 20, .echo = seed % 2 == 0, .tells_timeout = seed % 3 == 0});
        world.run(2000);
        EXPECT_EQ(world.wrong, 0) << seed;
        EXPECT_EQ(world.interrupted, 0) << seed;
        EXPECT_GT(world.right, 1000) << seed;
        EXPECT_GT(world.retries, 100) << seed;
    }
}

}  // namespace
}  // namespace panelgate::serial_server::test::world_test
