// What stands around serving: families and limits of listeners, how they open, and how long the end
// waits.
#include <gmock/gmock.h>

#include <boost/system/errc.hpp>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "command_run.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/gateway/prepare.hpp"
#include "panelgate/gateway/servers.hpp"
#include "panelgate/rt/log.hpp"
#include "support/manual_clock.hpp"

namespace panelgate::commands::serving_test {
namespace {

namespace errc = boost::system::errc;
using ::testing::HasSubstr;

TEST(AddressFamilies, AllAddressesOfIpv6AreThoseOfIpv4WhereNobodyElseHasThePort) {
    const struct {
        const char* before;  ///< another listener's address, or none
        std::uint16_t port;  ///< ... and port
        std::uint16_t six;   ///< port of the listener on all addresses of IPv6
        std::uint16_t http;  ///< port of http on 127.0.0.1, or 0 for none
        bool ipv6_only;
    } kRows[] = {
        {"0.0.0.0", 1502, 502, 0, false}, {"0.0.0.0", 502, 502, 0, true},
        {nullptr, 0, 502, 0, false},      {nullptr, 0, 502, 502, true},
        {"127.0.0.1", 0, 0, 0, false},  // any free port is never the same
    };
    for (const auto& row : kRows) {
        config::Config config;
        config.modbus_tcp.resize(row.before != nullptr ? 2 : 1);
        if (row.before != nullptr) config.modbus_tcp[0].address = row.before;
        config.modbus_tcp[0].port = row.port;
        config.modbus_tcp.back().address = "::";
        config.modbus_tcp.back().port = row.six;
        if (row.http != 0) config.http.emplace().port = row.http;
        gateway::separate_families(config);
        EXPECT_EQ(config.modbus_tcp.back().ipv6_only, row.ipv6_only) << &row - kRows;
        if (row.before != nullptr) EXPECT_FALSE(config.modbus_tcp.front().ipv6_only);
    }
}

class ConnectionLimits : public testing::Test {
  protected:
    ConnectionLimits() {
        config.lines.resize(2);
        config.modbus_tcp.resize(1);
        config.http.emplace();
    }
    std::size_t modbus() const { return config.modbus_tcp[0].max_connections; }
    std::size_t http() const { return config.http->max_connections; }
    config::Config config;
};

TEST_F(ConnectionLimits, StayWhereThereAreDescriptorsEnough) {
    const std::size_t enough =
        1024 + 256 + gateway::kOwnDescriptors + 2 * gateway::kDescriptorsPerLine;
    EXPECT_EQ(gateway::fit_connections(config, enough), "");
    EXPECT_EQ(modbus(), 1024u);
    EXPECT_EQ(http(), 256u);
    EXPECT_NE(gateway::fit_connections(config, enough - 1), "");
}

TEST_F(ConnectionLimits, LeaveDevicesProbesAndTheLogTheirDescriptors) {
    EXPECT_EQ(gateway::fit_connections(config, 1024), "127.0.0.1:502 755, http 127.0.0.1:8080 188");
    EXPECT_LE(modbus() + http() + gateway::kOwnDescriptors + 2 * gateway::kDescriptorsPerLine,
              1024u);
}

TEST_F(ConnectionLimits, LeaveHandshakesTheirDescriptors) {
    config.modbus_tcp[0].tls.emplace();
    gateway::fit_connections(config, 1024);
    EXPECT_LE(modbus() + http() + gateway::kOwnDescriptors + 2 * gateway::kDescriptorsPerLine +
                  config.modbus_tcp[0].tls->max_handshakes,
              1024u);
}

TEST_F(ConnectionLimits, LetSomebodyInEvenWithHardlyAny) {
    gateway::fit_connections(config, 64);
    EXPECT_EQ(modbus(), 12u);
    EXPECT_EQ(http(), 3u);
    config.http.reset();
    EXPECT_EQ(gateway::fit_connections(config, 64), "");
}

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
        } catch (const gateway::CannotListen& error) {
            return error.what();
        }
        return "it stands";
    }

    test::ManualClock clock;
    gateway::Openings openings{clock};
    std::vector<gateway::ListenerHandle> handles;
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
    clock.advance(gateway::Openings::kPause);
    EXPECT_EQ(log.count("listening modbus_tcp=[2001:db8::7]:502"), 1u);
    EXPECT_EQ(openings.missing(), "");
    EXPECT_EQ(clock.armed(), 0u);
}

TEST_F(OpeningsTest, P7NothingEndsAGatewayThatServes) {
    first = errc::address_not_available;
    add("192.0.2.7", 502, first);
    openings.open(handles);
    first = errc::address_in_use;
    clock.advance(10 * gateway::Openings::kPause);
    EXPECT_EQ(log.count("listener waits modbus_tcp=192.0.2.7:502 why=\"Address already in use\""),
              1u);
    first = errc::success;
    clock.advance(gateway::Openings::kPause);
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
    EXPECT_EQ(gateway::listening_advice(errc::make_error_code(errc::permission_denied), 1502), "");
}

TEST(Ending, P3WaitsForTheLongestAnswerAndForTenSecondsAtLeast) {
    Ending ending;
    EXPECT_EQ(ending.patience(), 10s);
    ending.longest_answer = 2s;
    EXPECT_EQ(ending.patience(), 10s);
    ending.longest_answer = 10min;
    EXPECT_GT(ending.patience(), 10min);
}

}  // namespace
}  // namespace panelgate::commands::serving_test
