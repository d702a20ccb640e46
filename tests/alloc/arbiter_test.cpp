// The pure arbiter: from submit() to Finish nothing is taken from the heap.

#include "panelgate/arbiter/arbiter.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <optional>
#include <utility>
#include <variant>

#include "counting.hpp"
#include "panel.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::arbiter {
namespace {

constexpr int kWarmUp = 3000;  // turns
constexpr int kCounted = 3000;

Settings settings() {
    Settings settings;
    settings.serial = {38400, 8, Parity::none, 1};
    settings.explain = true;
    settings.stations.resize(3);
    for (std::uint8_t id = 1; id <= 3; ++id) settings.stations[id - 1u].id = id;
    settings.stations[2].max_age = 1ms;
    return settings;
}

/// A line of panels that answer everything after a millisecond, in virtual time.
class Play {
  public:
    Play() {
        arbiter_.on_line_up(now_);
        run();
    }
    void submit(Client client, std::uint8_t station, const modbus::Request& request) {
        Job job{.station = station, .request = request, .client = client, .host = 1 + client % 2};
        job.priority = request.is_read() ? PriorityClass::read : PriorityClass::write;
        if (client == 8) job.priority = PriorityClass::poll;
        ASSERT_TRUE(arbiter_.submit(now_, std::move(job)));
        ++open_;
        drain();
    }
    /// Until everybody is answered.
    void run() {
        for (int i = 0; i < 1000 && open_ > 0; ++i) {
            if (reply_) {
                now_ += 20ms;
                const Bytes reply = *std::exchange(reply_, std::nullopt);
                arbiter_.on_rx(now_, reply);
            } else {
                now_ = arbiter_.next_deadline().value();
                arbiter_.on_deadline(now_);
            }
            drain();
        }
        ASSERT_EQ(open_, 0);
    }
    const Arbiter& arbiter() const { return arbiter_; }

  private:
    void drain() {
        while (auto action = arbiter_.poll_action()) {
            if (const auto* sent = std::get_if<Transmit>(&*action))
                reply_ = test::reply_to(sent->adu);
            if (const auto* done = std::get_if<Finish>(&*action)) {
                --open_;
                EXPECT_TRUE(done->pdu.has_value());
            }
        }
    }

    Arbiter arbiter_{settings()};
    TimePoint now_{1h};
    std::optional<Bytes> reply_;
    int open_ = 0;
};

void expect_no_allocations(const std::function<void(Play&)>& turn) {
    if (!test::counts_allocations()) GTEST_SKIP() << "the heap is not ours";
    Play play;
    for (int i = 0; i < kWarmUp; ++i) turn(play);
    const auto before = test::allocations();
    test::watch_allocations(true);
    for (int i = 0; i < kCounted; ++i) turn(play);
    test::watch_allocations(false);
    EXPECT_EQ(test::allocations() - before, 0u) << "in " << kCounted << " turns";
}

modbus::Request read(unsigned first, unsigned count) {
    return modbus::Request::read({modbus::Table::holding_registers, first, count});
}
modbus::Request write() {
    return modbus::Request::make(modbus::encode_write_register(5, 1), modbus::QuantityCheck::fit)
        .value();
}

TEST(ArbiterAllocations, OneClientReadsOneStation) {
    const modbus::Request ten = read(100, 10);
    expect_no_allocations([&](Play& play) {
        play.submit(1, 1, ten);
        play.run();
    });
}

TEST(ArbiterAllocations, ManyClientsReadSeveralStations) {
    const modbus::Request ten = read(100, 10);
    const modbus::Request many = read(0, 100);
    expect_no_allocations([&](Play& play) {
        for (Client client = 1; client <= 8; ++client) {
            play.submit(client, static_cast<std::uint8_t>(1 + client % 3), ten);
            play.submit(client, static_cast<std::uint8_t>(1 + client % 2), many);
        }
        play.run();
    });
}

TEST(ArbiterAllocations, ReadsShareOneTransaction) {
    const modbus::Request front = read(100, 10);
    const modbus::Request behind = read(110, 10);
    const modbus::Request inner = read(102, 2);
    expect_no_allocations([&](Play& play) {
        for (Client client = 1; client <= 8; ++client) {
            play.submit(client, 1, client % 2 == 0 ? front : behind);
            play.submit(client, 1, inner);
        }
        play.run();
    });
}

TEST(ArbiterAllocations, ClientsWriteBesideReads) {
    const modbus::Request ten = read(100, 10);
    const modbus::Request one = write();
    expect_no_allocations([&](Play& play) {
        for (Client client = 1; client <= 4; ++client) {
            play.submit(client, 3, ten);
            play.submit(client, 2, one);
        }
        play.run();
    });
}

}  // namespace
}  // namespace panelgate::arbiter
