#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>

#include "dispatch.hpp"
#include "held_bus.hpp"
#include "support/hex.hpp"

namespace panelgate::tcp_server {
namespace {

using modbus::ExceptionCode;

const Bytes kRead = "03 0000 0001"_hex;
const Bytes kWrite = "06 0000 0001"_hex;
const Bytes kHalfAWrite = "06 0000"_hex;

/// Stations 1 and 2 on one line; 2 may only be read, also by its alias 100.
class RightsOrder : public testing::Test {
  protected:
    RightsOrder() {
        settings.lines = {"floor1"};
        settings.units[100] = {"floor1", 2};
        bus.protect(2);
    }
    Decision judge(std::uint8_t unit, ByteView pdu) {
        const std::vector<LineInfo> lines{{"floor1", &bus, {1, 2}, true}};
        return decide(unit, pdu, settings, UnitMap(settings, lines));
    }
    /// 0: it is not refused.
    int refused(std::uint8_t unit, ByteView pdu) {
        const Decision decision = judge(unit, pdu);
        const auto* refusal = std::get_if<Refuse>(&decision);
        return refusal != nullptr ? static_cast<int>(refusal->code) : 0;
    }

    boost::asio::io_context context;
    HeldBus bus{context};
    Settings settings;
};

TEST_F(RightsOrder, AStationThatMayOnlyBeReadIsRead) {
    EXPECT_EQ(refused(2, kRead), 0);
    EXPECT_EQ(refused(100, kRead), 0);
}

TEST_F(RightsOrder, AWriteToItIsRefusedByWhateverUnitItComes) {
    EXPECT_EQ(refused(1, kWrite), 0);
    EXPECT_EQ(refused(2, kWrite), 1);
    EXPECT_EQ(refused(100, kWrite), 1);
}

TEST_F(RightsOrder, RightsAreJudgedBeforeTheStructure) {
    EXPECT_EQ(refused(1, kHalfAWrite), 3);
    EXPECT_EQ(refused(2, kHalfAWrite), 1);
    EXPECT_EQ(refused(0, kHalfAWrite), 1) << "a broadcast would reach station 2";
    bus.rights = {};
    EXPECT_EQ(refused(0, kHalfAWrite), 3);
}

TEST_F(RightsOrder, TheRouteIsJudgedBeforeTheRights) {
    EXPECT_EQ(refused(250, kWrite), 0x0A);
    settings.read_only = true;
    EXPECT_EQ(refused(250, kWrite), 1) << "but for the listener's own";
}

TEST_F(RightsOrder, ABroadcastIsRefusedWhoeverItsAliasNames) {
    settings.units[99] = {"floor1", 0};
    EXPECT_EQ(refused(0, kWrite), 1);
    EXPECT_EQ(refused(99, kWrite), 1);
    bus.rights = {};
    EXPECT_EQ(refused(0, kWrite), 0);
    EXPECT_EQ(refused(99, kWrite), 0);
}

}  // namespace
}  // namespace panelgate::tcp_server
