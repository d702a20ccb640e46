#include "panelgate/config/deadlines.hpp"

#include <gtest/gtest.h>

#include "panelgate/base/serial_format.hpp"

namespace panelgate::config::client_timeout_test {
namespace {

Line line_at(int baud, int retries = 1) {
    Line line;
    line.device.serial = {baud, 8, Parity::even, 1};
    line.arbiter.unlisted.retries = retries;
    return line;
}

TEST(ClientTimeout, IsTheDeadlineByWhichEveryRequestIsAnswered) {
    Line line = line_at(38400);
    EXPECT_EQ(client_timeout(line).worst, 2s);
    line.arbiter.queue.deadline = 700ms;
    EXPECT_EQ(client_timeout(line).worst, 700ms);
}

TEST(ClientTimeout, AQuickLineNeedsNothing) {
    Line line = line_at(38400);
    line.arbiter.queue.deadline = 450ms;
    EXPECT_FALSE(client_timeout(line).quick);
}

TEST(ClientTimeout, QuickSettingsLetAllAttemptsOfTheLongestReadFit) {
    for (const int baud : {9600, 19200, 38400, 115200}) {
        for (const int retries : {0, 1, 2}) {
            const Line line = line_at(baud, retries);
            const auto quick = client_timeout(line).quick;
            ASSERT_TRUE(quick) << baud;
            EXPECT_LT(quick->deadline, kQuickClient);
            const Duration request =
                wire_time(line.device.serial, 8) + silent_interval(line.device.serial);
            const Duration reply = wire_time(line.device.serial, 255);
            if (quick->most_registers) continue;
            EXPECT_LE((quick->retries + 1) * (request + quick->response_timeout) + reply,
                      quick->deadline)
                << baud << ", " << retries;
        }
    }
    EXPECT_EQ(client_timeout(line_at(38400)).quick->response_timeout, 180ms);
    EXPECT_EQ(client_timeout(line_at(9600)).quick->retries, 1);
}

TEST(ClientTimeout, ASlowWireTakesShorterReadsOrNone) {
    const auto slow = client_timeout(line_at(2400)).quick;
    ASSERT_TRUE(slow);
    EXPECT_EQ(slow->retries, 0);
    ASSERT_TRUE(slow->most_registers);
    EXPECT_GT(*slow->most_registers, 10u);
    EXPECT_LT(*slow->most_registers, 30u);
    EXPECT_FALSE(client_timeout(line_at(300)).quick) << "not even one register";
}

}  // namespace
}  // namespace panelgate::config::client_timeout_test
