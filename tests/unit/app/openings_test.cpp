#include "servers.hpp"

#include <gmock/gmock.h>

#include <boost/system/errc.hpp>

#include "panelgate/rt/log.hpp"
#include "support/manual_clock.hpp"

namespace panelgate::app::openings_test {
namespace {

namespace errc = boost::system::errc;
using ::testing::HasSubstr;

class OpeningsTest : public testing::Test {
  protected:
    void add(const std::string& address, std::uint16_t port, errc::errc_t& why) {
        handles.push_back({"modbus_tcp", address, port,
                           [this, &why] {
                               ++tries;
                               return errc::make_error_code(why);
                           },
                           [port] { return port; }});
    }
    std::string refusal() {
        try {
            openings.open(handles);
        } catch (const CannotListen& error) {
            return error.what();
        }
        return "it stands";
    }

    test::ManualClock clock;
    Openings openings{clock};
    std::vector<ListenerHandle> handles;
    rt::LogTap log;
    int tries = 0;
    errc::errc_t first = errc::success;
    errc::errc_t second = errc::success;
};

TEST_F(OpeningsTest, SayWhereEachListens) {
    add("127.0.0.1", 502, first);
    add("::1", 502, second);
    openings.open(handles);
    EXPECT_EQ(log.count("info listening modbus_tcp=127.0.0.1:502"), 1u);
    EXPECT_EQ(log.count("info listening modbus_tcp=[::1]:502"), 1u);
    EXPECT_EQ(openings.missing(), "");
    EXPECT_EQ(openings.listening(), "modbus_tcp 127.0.0.1:502, modbus_tcp [::1]:502");
    EXPECT_EQ(clock.armed(), 0u);
}

TEST_F(OpeningsTest, P7AnAddressThatIsNotThereYetIsTriedUntilItIs) {
    first = errc::address_not_available;
    add("2001:db8::7", 502, first);
    add("127.0.0.1", 502, second);
    openings.open(handles);
    EXPECT_EQ(log.count("listening modbus_tcp=127.0.0.1:502"), 1u);
    EXPECT_THAT(openings.missing(), HasSubstr("modbus_tcp [2001:db8::7]:502"));
    clock.advance(1h);
    EXPECT_EQ(log.count("listener waits"), 1u);
    first = errc::success;
    clock.advance(Openings::kPause);
    EXPECT_EQ(log.count("listening modbus_tcp=[2001:db8::7]:502"), 1u);
    EXPECT_EQ(openings.missing(), "");
    EXPECT_EQ(clock.armed(), 0u);
}

TEST_F(OpeningsTest, P7NothingEndsAGatewayThatServes) {
    first = errc::address_not_available;
    add("192.0.2.7", 502, first);
    openings.open(handles);
    first = errc::address_in_use;
    clock.advance(10 * Openings::kPause);
    EXPECT_EQ(log.count("listener waits modbus_tcp=192.0.2.7:502 why=\"Address already in use\""),
              1u);
    first = errc::success;
    clock.advance(Openings::kPause);
    EXPECT_EQ(openings.missing(), "");
}

TEST_F(OpeningsTest, NobodyIsTriedAgainAfterTheEnd) {
    first = errc::address_not_available;
    add("192.0.2.7", 502, first);
    openings.open(handles);
    openings.stop();
    clock.advance(1min);
    EXPECT_EQ(tries, 1);
}

TEST_F(OpeningsTest, WhatTimeDoesNotMendIsToldWithWhatHelps) {
    first = errc::permission_denied;
    add("0.0.0.0", 502, first);
    const std::string why = refusal();
    EXPECT_THAT(why, HasSubstr("cannot listen on 0.0.0.0:502: Permission denied; "));
    EXPECT_THAT(why, HasSubstr("CAP_NET_BIND_SERVICE"));
    EXPECT_THAT(why, HasSubstr("setcap cap_net_bind_service=+ep"));
    EXPECT_THAT(why, HasSubstr("sysctl net.ipv4.ip_unprivileged_port_start=502"));
    first = errc::address_in_use;
    EXPECT_THAT(refusal(), HasSubstr("ss -ltnp 'sport = :502'"));
    first = errc::address_family_not_supported;
    EXPECT_THAT(refusal(), HasSubstr("IPv6 is off"));
}

TEST_F(OpeningsTest, AdviceIsGivenOnlyWhereItHelps) {
    EXPECT_EQ(listening_advice(errc::make_error_code(errc::permission_denied), 1502), "");
}

}  // namespace
}  // namespace panelgate::app::openings_test
