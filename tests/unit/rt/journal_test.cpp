#include "panelgate/rt/log_output.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <string>
#include <vector>

namespace panelgate::rt::journal_test {
namespace {

TEST(Journal, NamesFieldsAfterThoseOfTheEvent) {
    const std::vector<LogField> fields{{"line", "floor1"}, {"modbus_tcp", "a=b"}, {"why", ""}};
    EXPECT_EQ(journal_fields(LogLevel::warn, "line down", fields),
              "PRIORITY=4\nSYSLOG_IDENTIFIER=panelgate\nPANELGATE_EVENT=line down\n"
              "PANELGATE_LINE=floor1\nPANELGATE_MODBUS_TCP=a=b\nPANELGATE_WHY=\n");
}

TEST(Journal, AValueOfSeveralLinesGoesBehindItsLength) {
    std::string fields;
    append_journal_field(fields, "why", "one\ntwo");
    using namespace std::string_literals;
    EXPECT_EQ(fields, "PANELGATE_WHY\n\x07\0\0\0\0\0\0\0one\ntwo\n"s);
}

TEST(Journal, TakesNoNameThatJournaldWouldDrop) {
    std::string fields;
    append_journal_field(fields, "a b-c." + std::string(100, 'x'), "1");
    EXPECT_EQ(fields, "PANELGATE_A_B_C_" + std::string(48, 'X') + "=1\n");
}

TEST(Journal, HasThePrioritiesOfSyslog) {
    EXPECT_EQ(journal_priority(LogLevel::error), 3);
    EXPECT_EQ(journal_priority(LogLevel::warn), 4);
    EXPECT_EQ(journal_priority(LogLevel::info), 6);
    EXPECT_EQ(journal_priority(LogLevel::debug), 7);
    EXPECT_EQ(journal_priority(LogLevel::trace), 7);
}

TEST(Journal, IsStderrOnlyIfDeviceAndInodeAreItsOwn) {
    EXPECT_TRUE(is_journal_stream("9:12345", 9, 12345));
    for (const char* other : {"9:1234", "8:12345", "9", "", "9:12345 ", "09:12345"})
        EXPECT_FALSE(is_journal_stream(other, 9, 12345)) << other;
}

TEST(Journal, TakesEachEntryAsOneDatagramAndWhatItDoesNotTakeWaits) {
    std::array<int, 2> ends{};
    ASSERT_EQ(::socketpair(AF_UNIX, SOCK_DGRAM, 0, ends.data()), 0);
    LogOutput output(ends[1]);
    constexpr int kEntries = 2000;  // more than a socket keeps
    for (int i = 0; i < kEntries; ++i) output.write("MESSAGE=" + std::to_string(i) + '\n');
    EXPECT_TRUE(output.pending());
    for (int i = 0; i < kEntries; ++i) {
        std::array<char, 4096> datagram{};
        const ssize_t got = ::recv(ends[0], datagram.data(), datagram.size(), MSG_DONTWAIT);
        ASSERT_GT(got, 0);
        EXPECT_EQ(std::string(datagram.data(), static_cast<std::size_t>(got)),
                  "MESSAGE=" + std::to_string(i) + '\n');
        output.flush();
    }
    EXPECT_EQ(output.dropped(), 0u);
    for (const int end : ends) ::close(end);
}

}  // namespace
}  // namespace panelgate::rt::journal_test
