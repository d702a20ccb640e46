#include "panelgate/rt/log_output.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace panelgate::rt::log_output_test {
namespace {

/// Both ends of a channel to a reader that reads only on request.
struct Way {
    int reader = -1;
    int writer = -1;

    Way(int reading, int writing) : reader(reading), writer(writing) {
        ::fcntl(reader, F_SETFL, O_NONBLOCK);
    }
    Way(Way&& other) noexcept
        : reader(std::exchange(other.reader, -1)), writer(std::exchange(other.writer, -1)) {}
    ~Way() {
        if (reader >= 0) ::close(reader);
        if (writer >= 0) ::close(writer);
    }
    std::string read() const {
        std::string all;
        std::array<char, 4096> part{};
        for (;;) {
            const ssize_t got = ::read(reader, part.data(), part.size());
            if (got <= 0) return all;
            all.append(part.data(), static_cast<std::size_t>(got));
        }
    }
};

using Ends = std::array<int, 2>;

Way pipe_channel() {
    Ends ends{};
    if (::pipe(ends.data()) != 0) std::abort();
    return {ends[0], ends[1]};
}

Way socket_channel() {
    Ends ends{};
    if (::socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()) != 0) std::abort();
    return {ends[0], ends[1]};
}

Way terminal_channel() {
    Ends ends{};
    termios raw{};
    ::cfmakeraw(&raw);
    if (::openpty(&ends[0], &ends[1], nullptr, &raw, nullptr) != 0) std::abort();
    return {ends[0], ends[1]};
}

std::string line_of(int number) { return std::to_string(number) + std::string(60, '.') + '\n'; }

class LogOutputTest : public testing::TestWithParam<Way (*)()> {
  protected:
    /// Reads and flushes until nothing moves any more.
    std::string drain(LogOutput& output) const {
        std::string all;
        for (;;) {
            output.flush();
            const std::string part = way_.read();
            if (part.empty() && !output.pending()) return all;
            all += part;
        }
    }
    Way way_ = GetParam()();
};

INSTANTIATE_TEST_SUITE_P(Of, LogOutputTest,
                         testing::Values(&pipe_channel, &socket_channel, &terminal_channel),
                         [](const auto& info) {
                             return info.param == &pipe_channel     ? "APipe"
                                    : info.param == &socket_channel ? "ASocket"
                                                                    : "ATerminal";
                         });

TEST_P(LogOutputTest, ASlowReaderLosesNoLineThatFitsAndBlocksNoWriter) {
    LogOutput output(way_.writer, 1 << 20);
    std::string wanted;
    for (int i = 0; i < 10000; ++i) {
        output.write(line_of(i));  // would never end if it waited
        wanted += line_of(i);
    }
    EXPECT_TRUE(output.pending());
    EXPECT_EQ(drain(output), wanted);
    EXPECT_EQ(output.dropped(), 0u);
}

TEST_P(LogOutputTest, ExcessLinesAreDroppedCountedAndReported) {
    constexpr std::size_t kMost = 1000;
    LogOutput output(way_.writer, kMost);
    output.on_lost([](std::uint64_t lines) { return "lost " + std::to_string(lines) + "\n"; });
    constexpr int kLines = 10000;
    for (int i = 0; i < kLines; ++i) output.write(line_of(i));
    EXPECT_GT(output.dropped(), 0u);
    std::istringstream all(drain(output));
    int next = 0;
    for (std::string line; std::getline(all, line);) {
        if (line.starts_with("lost ")) {
            next += std::stoi(line.substr(5));
        } else {
            ASSERT_EQ(line + '\n', line_of(next++)) << "in order, and each line whole";
        }
    }
    EXPECT_EQ(next, kLines) << "each line was handed over or told to be lost";
    output.write("and on\n");
    EXPECT_EQ(drain(output), "and on\n");
}

TEST_P(LogOutputTest, CallsOnPendingWhenLinesAreQueuedAndLeavesTheDescriptorOfOthersAsItWas) {
    const int before = ::fcntl(way_.writer, F_GETFL);
    LogOutput output(way_.writer);
    int told = 0;
    output.on_pending([&] { ++told; });
    output.write(line_of(0));
    EXPECT_EQ(::fcntl(way_.writer, F_GETFL), before);
    EXPECT_EQ(told, 0);
    while (!output.pending()) output.write(line_of(1));
    EXPECT_EQ(told, 1);
}

TEST_P(LogOutputTest, AReaderThatClosedCostsNothing) {
    std::signal(SIGPIPE, SIG_IGN);  // as the program does
    LogOutput output(way_.writer);
    ::close(std::exchange(way_.reader, -1));
    for (int i = 0; i < 10000; ++i) output.write(line_of(i));
    EXPECT_FALSE(output.pending());
}

TEST(LogOutput, WhatADeviceRefusesIsCounted) {
    const int full = ::open("/dev/full", O_WRONLY | O_CLOEXEC);
    ASSERT_GE(full, 0);
    LogOutput out(full);
    out.on_lost([](std::uint64_t) { return std::string("lost\n"); });
    for (int i = 0; i < 3; ++i) out.write("log\n");
    EXPECT_EQ(out.dropped(), 3u);
    EXPECT_FALSE(out.pending());
    ::close(full);
}

TEST(LogOutput, WritersOfOneFileDoNotOverwriteEachOther) {
    FILE* file = std::tmpfile();
    ASSERT_NE(file, nullptr);
    const int descriptor = ::fileno(file);
    LogOutput out(descriptor);
    ASSERT_EQ(::write(descriptor, "before\n", 7), 7);  // as `command >file 2>&1` does
    out.write("log\n");
    ASSERT_EQ(::write(descriptor, "after\n", 6), 6);
    std::array<char, 64> text{};
    const ssize_t size = ::pread(descriptor, text.data(), text.size(), 0);
    EXPECT_EQ(std::string(text.data(), static_cast<std::size_t>(size)), "before\nlog\nafter\n");
    std::fclose(file);
}

TEST(Journal, NamesFieldsAfterThoseOfTheEvent) {
    const std::vector<LogField> fields{{"line", "floor1"}, {"modbus_tcp", "a=b"}, {"why", ""}};
    EXPECT_EQ(journal_fields(LogLevel::warn, "line down", fields),
              "PRIORITY=4\nSYSLOG_IDENTIFIER=panelgate\nPANELGATE_EVENT=line down\n"
              "PANELGATE_LINE=floor1\nPANELGATE_MODBUS_TCP=a=b\nPANELGATE_WHY=\n");
    std::string lines;  // a value of several lines goes behind its length
    append_journal_field(lines, "why", "one\ntwo");
    using namespace std::string_literals;
    EXPECT_EQ(lines, "PANELGATE_WHY\n\x07\0\0\0\0\0\0\0one\ntwo\n"s);
    std::string name;  // that journald would drop
    append_journal_field(name, "a b-c." + std::string(100, 'x'), "1");
    EXPECT_EQ(name, "PANELGATE_A_B_C_" + std::string(48, 'X') + "=1\n");
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
    Ends ends{};
    ASSERT_EQ(::socketpair(AF_UNIX, SOCK_DGRAM, 0, ends.data()), 0);
    const Way way(ends[0], ends[1]);
    LogOutput output(way.writer);
    constexpr int kEntries = 2000;  // more than a socket keeps
    for (int i = 0; i < kEntries; ++i) output.write("MESSAGE=" + std::to_string(i) + '\n');
    EXPECT_TRUE(output.pending());
    for (int i = 0; i < kEntries; ++i) {
        std::array<char, 4096> datagram{};
        const ssize_t got = ::recv(way.reader, datagram.data(), datagram.size(), MSG_DONTWAIT);
        ASSERT_GT(got, 0);
        EXPECT_EQ(std::string(datagram.data(), static_cast<std::size_t>(got)),
                  "MESSAGE=" + std::to_string(i) + '\n');
        output.flush();
    }
    EXPECT_EQ(output.dropped(), 0u);
}

}  // namespace
}  // namespace panelgate::rt::log_output_test
