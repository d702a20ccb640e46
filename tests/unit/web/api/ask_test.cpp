#include "reading.hpp"

#include <gtest/gtest.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <exception>
#include <memory>
#include <optional>
#include <utility>

#include "support/fake_bus.hpp"

namespace panelgate::web::ask_test {
namespace {

class Ask : public ::testing::Test {
  protected:
    Ask() : bus(io.get_executor()) {
        bus.script = [](const bus::Request&) { return std::nullopt; };
    }
    void ask_once() {
        bus::Request request{
            .station = 5,
            .request = modbus::Request::read({modbus::Table::holding_registers, 0, 1})};
        boost::asio::co_spawn(io, ask(caller, &bus, std::move(request)),
                              [this](std::exception_ptr failed, bus::Answer answer) {
                                  ++ended;
                                  if (failed) {
                                      ++aborted;
                                  } else {
                                      got = std::move(answer);
                                  }
                              });
        io.restart();
        io.poll();
    }
    void run() {
        io.restart();
        io.poll();
    }

    boost::asio::io_context io;
    test::FakeBus bus;
    std::shared_ptr<Caller> caller = std::make_shared<Caller>(12, "10.0.0.7");
    std::optional<bus::Answer> got;
    int ended = 0;
    int aborted = 0;
};

TEST_F(Ask, AsksAsTheCaller) {
    ask_once();
    ASSERT_EQ(bus.requests.size(), 1u);
    EXPECT_EQ(bus.requests[0].client, 12u);
    EXPECT_EQ(bus.names[12], "http 10.0.0.7");
    EXPECT_EQ(bus.requests[0].host, bus::host_of("10.0.0.7"));
    EXPECT_EQ(bus.requests[0].station, 5u);
    bus.release(test::FakeBus::reply({3, 2, 0, 7}));
    run();
    ASSERT_TRUE(got);
    EXPECT_EQ(*got->pdu, (Bytes{3, 2, 0, 7}));
}

TEST_F(Ask, KnowsNoHostOfACallerWithoutAnAddress) {
    caller = std::make_shared<Caller>(13, "");
    ask_once();
    EXPECT_EQ(bus.requests[0].host, 0u);
}

TEST_F(Ask, TakesBackOnceWhatACallerThatLeavesHasAskedFor) {
    ask_once();
    ask_once();
    caller->leave();
    run();
    EXPECT_EQ(bus.cancelled, std::vector<bus::ClientId>{12});
    EXPECT_EQ(ended, 2);
    EXPECT_EQ(aborted, 2);
}

TEST_F(Ask, SendsNothingForACallerThatHasLeft) {
    caller->leave();
    ask_once();
    EXPECT_TRUE(bus.requests.empty());
    EXPECT_EQ(aborted, 1);
}

}  // namespace
}  // namespace panelgate::web::ask_test
