#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <sstream>
#include <string>
#include <utility>

#include "panelgate/gateway/plant.hpp"
#include "support/fake_bus.hpp"
#include "support/hex.hpp"

namespace panelgate::gateway::example_face_test {
namespace {

using namespace test;

/// All that a new northbound protocol needs: "press 100" reads a register and "press 100 7" writes
/// it. What may be read, who may write, scheduling and outstanding replies are handled elsewhere.
class TextFace {
  public:
    explicit TextFace(const Plant& plant) : plant_(plant) {}

    void hear(const std::string& line, const std::function<void(std::string)>& say) {
        std::istringstream words(line);
        std::string name;
        std::uint16_t address = 0;
        std::uint16_t value = 0;
        words >> name >> address;
        const Station* station = plant_.find(name);
        if (station == nullptr || !words) return say("no such station or address");
        const Bytes pdu = words >> value ? modbus::encode_write_register(address, value)
                                         : modbus::encode_read({.first = address});
        auto request = modbus::Request::make(pdu, modbus::QuantityCheck::wide);
        if (!request) return say(std::string(label(request.error())));
        station->bus->transact({station->id, std::move(*request), client_}, [=](bus::Answer a) {
            if (a.refusal) return say("not allowed");
            say(a.pdu ? to_hex(*a.pdu) : std::string(label(a.pdu.error())));
        });
    }

  private:
    const Plant& plant_;
    bus::ClientId client_ = bus::next_client_id();
};

class ExampleFaceTest : public testing::Test {
  protected:
    ExampleFaceTest() {
        floor1.name = "floor1";
        floor1.stations.emplace_back().id = 31;
        floor1.stations[0].name = "press";
        plant.add(floor1, bus, nullptr);
    }

    std::string ask(const std::string& line) {
        std::string said;
        face.hear(line, [&](std::string text) { said = std::move(text); });
        io.restart();
        io.run();
        return said;
    }

    boost::asio::io_context io;
    FakeBus bus{io.get_executor()};
    config::Line floor1;
    Plant plant;
    TextFace face{plant};
};

TEST_F(ExampleFaceTest, ANewWayInNeedsThePlantAndTheBusSeamAndNothingElse) {
    bus.script = [](const bus::Request& request) {
        return FakeBus::reply(request.request.is_read() ? "03 02 00 2A"_hex
                                                        : request.request.pdu());
    };
    EXPECT_EQ(ask("press 100"), "03 02 00 2a");
    EXPECT_EQ(ask("press 100 7"), "06 00 64 00 07");
    EXPECT_EQ(ask("oven 100"), "no such station or address");
    ASSERT_EQ(bus.requests.size(), 2u);
    EXPECT_EQ(bus.requests[0].station, 31);
    EXPECT_EQ(bus.requests[0].request.pdu(), "03 00 64 00 01"_hex);
}

TEST_F(ExampleFaceTest, WhatIsNotAllowedOrNotAnsweredHasItsWordsAlready) {
    EXPECT_EQ(ask("press 100"), label(Fault::timeout));
    bus.script = [](const bus::Request&) {
        bus::Answer refused = FakeBus::fault(Fault::denied, false);
        refused.refusal = bus::Refusal{};
        return refused;
    };
    EXPECT_EQ(ask("press 100 7"), "not allowed");
}

}  // namespace
}  // namespace panelgate::gateway::example_face_test
