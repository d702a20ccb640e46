// What stands around serving: families and limits of listeners, how they open, where HTTP listens,
// and how long the end waits.
#include <gmock/gmock.h>

#include <boost/system/errc.hpp>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "http_door.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/rt/log.hpp"
#include "load.hpp"
#include "command_run.hpp"
#include "servers.hpp"
#include "support/manual_clock.hpp"

namespace panelgate::app::serving_test {
namespace {

namespace errc = boost::system::errc;
using ::testing::HasSubstr;

class AddressFamilies : public testing::Test {
  protected:
    /// The setting of the last of these listeners.
    bool last_is_six_only() {
        separate_families(config);
        return config.modbus_tcp.back().ipv6_only;
    }
    void add(const char* address, std::uint16_t port) {
        config.modbus_tcp.emplace_back();
        config.modbus_tcp.back().address = address;
        config.modbus_tcp.back().port = port;
    }
    config::Config config;
};

TEST_F(AddressFamilies, AllAddressesOfIpv6AreThoseOfIpv4WhereNobodyElseHasThem) {
    add("0.0.0.0", 1502);
    add("::", 502);
    EXPECT_FALSE(last_is_six_only());
}

TEST_F(AddressFamilies, EachHasItsOwnKindOnOnePort) {
    add("0.0.0.0", 502);
    add("::", 502);
    EXPECT_TRUE(last_is_six_only());
    EXPECT_FALSE(config.modbus_tcp.front().ipv6_only);
    config.modbus_tcp.erase(config.modbus_tcp.begin());
    EXPECT_FALSE(last_is_six_only());
    config.http.emplace();
    config.http->port = 502;  // on 127.0.0.1
    EXPECT_TRUE(last_is_six_only());
}

TEST_F(AddressFamilies, AnyFreePortIsNeverTheSame) {
    add("127.0.0.1", 0);
    add("::", 0);
    EXPECT_FALSE(last_is_six_only());
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
    const std::size_t enough = 1024 + 256 + kOwnDescriptors + 2 * kDescriptorsPerLine;
    EXPECT_EQ(fit_connections(config, enough), "");
    EXPECT_EQ(modbus(), 1024u);
    EXPECT_EQ(http(), 256u);
    EXPECT_NE(fit_connections(config, enough - 1), "");
}

TEST_F(ConnectionLimits, LeaveDevicesProbesAndTheLogTheirDescriptors) {
    EXPECT_EQ(fit_connections(config, 1024), "127.0.0.1:502 755, http 127.0.0.1:8080 188");
    EXPECT_LE(modbus() + http() + kOwnDescriptors + 2 * kDescriptorsPerLine, 1024u);
}

TEST_F(ConnectionLimits, LetSomebodyInEvenWithHardlyAny) {
    fit_connections(config, 64);
    EXPECT_EQ(modbus(), 12u);
    EXPECT_EQ(http(), 3u);
    config.http.reset();
    EXPECT_EQ(fit_connections(config, 64), "");
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
    EXPECT_EQ(listening_advice(errc::make_error_code(errc::permission_denied), 1502), "");
}

/// Texts that are no YAML, and where their http section listens.
const struct {
    const char* text;
    const char* listen;
} kTexts[] = {
    {"lines: [\nhttp:\n  listen: 127.0.0.1:8081\n", "127.0.0.1:8081"},
    {"http: {listen: 127.0.0.1:8081, anonymous: operator}\nlines: [", "127.0.0.1:8081"},
    {"http: {anonymous: none, listen: \"[::1]:8081\"}\r\nlines: [", "[::1]:8081"},
    {"http:   # ours\r\n\r\n\tlisten: '0.0.0.0:80' # all\r\n}", "0.0.0.0:80"},
    {"\xEF\xBB\xBFhttp: {listen: 127.0.0.1:1}\n[", "127.0.0.1:1"},
    // Of others.
    {"", ""},
    {"modbus_tcp:\n  - listen: 127.0.0.1:502\nhttp:\n  hosts: [x]\nlog: [", ""},
    {"#http: {listen: 127.0.0.1:1}\nhttp:\n# listen: 127.0.0.1:2\n", ""},
    {"http: {hosts: [a]}\nmodbus_tcp: [{listen: 127.0.0.1:502}]\n[", ""},
    {"http:\n  relisten: 127.0.0.1:2\n", ""},
    // Deeper.
    {"http: {tls: {listen: 127.0.0.1:1}}\n[", ""},
    {"http: {tls: {listen: 127.0.0.1:1}, listen: 127.0.0.1:2}\n[", "127.0.0.1:2"},
    {"http:\n  tokens:\n    - listen: 127.0.0.1:1\n[", ""},
    {"http:\n  tls:\n    listen: 127.0.0.1:1\n  listen: 127.0.0.1:2\n[", "127.0.0.1:2"},
    // Of two none is taken.
    {"<<<<<<< ours\nhttp: {listen: 127.0.0.1:1}\n=======\n"
     "http: {listen: 127.0.0.1:2}\n>>>>>>> theirs\n",
     ""},
    {"http: {listen: 127.0.0.1:1}\nhttp: {anonymous: none}\n", ""},
    {"http: {listen: 127.0.0.1:1}\nhttp: {listen: 127.0.0.1:1}\n", "127.0.0.1:1"},
};

TEST(ListenInText, IsFoundInATextThatIsNoYamlUnlessItIsNotItsOwn) {
    for (const auto& row : kTexts) EXPECT_EQ(http_listen_in(row.text), row.listen) << row.text;
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
}  // namespace panelgate::app::serving_test
