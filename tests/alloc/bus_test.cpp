// A whole bus on one loop in virtual time: from transact() to the handler nothing is taken from the
// heap.

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <memory>
#include <utility>

#include "answering_line.hpp"
#include "counting.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/modbus/request.hpp"
#include "support/manual_clock.hpp"

namespace panelgate::bus {
namespace {

constexpr int kWarmUp = 5000;  // answers
constexpr int kCounted = 5000;

Settings settings() {
    Settings settings;
    settings.name = "floor1";
    settings.device = "memory";
    settings.trace.frames = 200;
    settings.doctor.step = 24h;  // what it thinks every few seconds is not of a transaction
    settings.arbiter.serial = {38400, 8, Parity::none, 1};
    settings.arbiter.stations.resize(2);
    for (std::uint8_t id = 1; id <= 2; ++id) {
        settings.arbiter.stations[id - 1u].id = id;
        settings.stations[id].name = "panel";
    }
    return settings;
}

/// Clients that ask again when they are answered; time passes when the loop has nothing else to do.
class BusAllocations : public testing::Test {
  protected:
    void SetUp() override {
        if (!test::counts_allocations()) GTEST_SKIP() << "the heap is not ours";
        bus = std::make_unique<Bus>(io.get_executor(), clock, settings(),
                                    std::make_unique<test::AnsweringLine>(clock, 1ms));
        bus->start();
    }
    const WhoRef who = make_who({.face = Face::http, .address = "10.0.0.7"});
    void ask(ClientId client) {
        bus->transact({.station = static_cast<std::uint8_t>(1 + client % 2),
                       .request = request,
                       .client = client,
                       .who = who},
                      [this, client](const Answer& answer) {
                          EXPECT_TRUE(answer.pdu.has_value());
                          ++answered;
                          ask(client);
                      });
    }
    void pump() {
        clock.jump();
        if (answered < wanted) boost::asio::post(io, [this] { pump(); });
    }
    void run(int answers) {
        wanted = answered + answers;
        boost::asio::post(io, [this] { pump(); });
        while (answered < wanted) {
            io.restart();
            io.poll();
        }
    }
    std::uint64_t count() {
        run(kWarmUp);
        const auto before = test::allocations();
        test::watch_allocations(true);
        run(kCounted);
        test::watch_allocations(false);
        return test::allocations() - before;
    }

    boost::asio::io_context io{1};
    test::ManualClock clock;
    modbus::Request request = modbus::Request::read({modbus::Table::holding_registers, 100, 10});
    std::unique_ptr<Bus> bus;
    int answered = 0;
    int wanted = 0;
};

TEST_F(BusAllocations, OneClientReads) {
    ask(1);
    EXPECT_LE(count(), 1u);  // the one that starts the loop from outside
}

TEST_F(BusAllocations, SixteenClientsReadTwoStations) {
    for (ClientId client = 1; client <= 16; ++client) ask(client);
    EXPECT_LE(count(), 1u);
}

}  // namespace
}  // namespace panelgate::bus
