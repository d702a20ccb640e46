#include "panelgate/rt/log.hpp"

#include <gmock/gmock.h>

namespace panelgate::rt::log_test {
namespace {

using ::testing::ElementsAre;

class LogTest : public ::testing::Test {
  protected:
    ~LogTest() override { set_up_log({}); }
    LogTap tap;
};

TEST_F(LogTest, QuotesInTextOnlyWhatHasToBe) {
    log(LogLevel::info, "line up", {{"line", "floor1"}, {"why", "say \"no\""}, {"empty", ""}});
    EXPECT_THAT(tap.lines(), ElementsAre(R"(info line up line=floor1 why="say \"no\"" empty="")"));
}

TEST_F(LogTest, GivesEachFieldAKeyOfItsOwnInJson) {
    set_up_log({LogLevel::info, LogFormat::json});
    log(LogLevel::warn, "cannot accept", {{"listener", "127.0.0.1:502"}, {"reason", "a\tb"}});
    EXPECT_THAT(tap.lines(),
                ElementsAre("\"level\":\"warn\",\"event\":\"cannot accept\",\"listener\":"
                            "\"127.0.0.1:502\",\"reason\":\"a\\u0009b\""));
}

TEST_F(LogTest, SaysNothingBelowItsLevel) {
    set_up_log({LogLevel::warn, LogFormat::text});
    log(LogLevel::info, "line up");
    EXPECT_EQ(tap.count(""), 0u);
}

TEST_F(LogTest, ThrottlesAClientWhateverItsPort) {
    for (int port = 50000; port < 50100; ++port) {
        log(LogLevel::info, "connection closed",
            {{"listener", "a:502"}, {"client", "10.0.0.7:" + std::to_string(port)}});
    }
    log(LogLevel::info, "connection closed", {{"listener", "a:502"}, {"client", "10.0.0.8:1"}});
    EXPECT_EQ(tap.count("client=10.0.0.7"), 3u);
    EXPECT_EQ(tap.count("client=10.0.0.8"), 1u);
}

TEST_F(LogTest, TopicsThatChangeDoNotFillTheLog) {
    for (int i = 0; i < 1000; ++i)
        log(LogLevel::warn, "mqtt write refused",
            {{"client", "mqtt"}, {"topic", "plant/" + std::to_string(i) + "/set"}, {"why", "odd"}});
    EXPECT_LE(tap.count("mqtt write refused client"), 70u);
}

TEST_F(LogTest, IdentifiesAClientByItsIpv6Address) {
    for (int port = 50000; port < 50100; ++port)
        log(LogLevel::info, "connection closed",
            {{"listener", "a:502"}, {"client", "[::1]:" + std::to_string(port)}});
    for (int host = 1; host <= 9; ++host)
        log(LogLevel::warn, "login failed",
            {{"listener", "a:80"}, {"client", "2001:db8::" + std::to_string(host)}});
    EXPECT_EQ(tap.count("client=[::1]"), 3u);
    EXPECT_EQ(tap.count("login failed"), 9u) << "none of them is another's port";
}

TEST_F(LogTest, ThrottlesASubjectWithChangingFieldsLikeOneThatRepeats) {
    for (int i = 0; i < 30; ++i) {
        for (const char* state : {"ok", "timeout", "damaged"})
            log_about("a to b", LogLevel::warn, "relay", {{"relay", "a to b"}, {"state", state}});
    }
    log_about("a to c", LogLevel::warn, "relay", {{"relay", "a to c"}, {"state", "ok"}});
    EXPECT_EQ(tap.count("\"a to b\""), 3u);
    EXPECT_EQ(tap.count("\"a to c\""), 1u);
}

}  // namespace
}  // namespace panelgate::rt::log_test
