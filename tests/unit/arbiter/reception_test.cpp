#include "panelgate/arbiter/arbiter.hpp"

#include <gtest/gtest.h>

#include <utility>

#include "support/hex.hpp"
#include "support/read_span.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter::reception_test {
namespace {

constexpr TimePoint kNow{1h};
const Bytes kRead = "03 00 6B 00 03"_hex;
const Bytes kReply = "03 06 02 2B 00 00 00 64"_hex;

Settings at(int baud) {
    Settings settings;
    settings.serial.baud = baud;
    return settings;
}

Job job_of(const Bytes& pdu, std::uint8_t station = 17) {
    return {.station = station, .request = test::request_of(pdu)};
}

Job stamped(const Settings& settings, const Bytes& pdu, std::uint8_t station = 17) {
    Admission admission(settings);
    Job job = job_of(pdu, station);
    admission.stamp(kNow, job);
    return job;
}

Duration room(const Job& job) { return job.deadline - job.start_by; }

class AdmissionTest : public testing::Test {
  protected:
    void remember() { admission_.memory().store(*test::read_span(17, kRead), kReply, kNow); }
    Admission admission_{Settings{}};
};

TEST_F(AdmissionTest, TicketsAreNeverUsedTwiceAlsoNotForAnswersFromMemory) {
    remember();
    Ticket last = 0;
    for (int i = 0; i < 10; ++i) {
        Job job = job_of(kRead);
        admission_.stamp(kNow, job);
        EXPECT_GT(job.ticket, last);
        const auto hit = admission_.from_memory(kNow, job, 1s);
        ASSERT_TRUE(hit);
        EXPECT_GT(hit->ticket, job.ticket);
        last = hit->ticket;
    }
}

TEST_F(AdmissionTest, P3TheDeadlineCountsFromTheArrival) {
    Settings settings;
    settings.queue.deadline = 700ms;
    const Job job = stamped(settings, kRead);
    EXPECT_EQ(job.arrived, kNow);
    EXPECT_EQ(job.deadline, kNow + 700ms);
}

TEST_F(AdmissionTest, P3AClientThatWaitsForLessHasAnEarlierDeadline) {
    Settings settings;
    settings.queue.deadline = 700ms;
    Admission admission(settings);
    Job job = job_of(kRead);
    job.within = 300ms;
    admission.stamp(kNow, job);
    EXPECT_EQ(job.deadline, kNow + 300ms);
    job.within = 1h;
    admission.stamp(kNow, job);
    EXPECT_EQ(job.deadline, kNow + 700ms);
}

TEST_F(AdmissionTest, P3WhatStartsAtTheLastMomentCanStillBeAnsweredByItsNormalReply) {
    for (const int baud : {1200, 9600, 115200}) {
        const Settings settings = at(baud);
        const Job job = stamped(settings, kRead);
        const Duration request = wire_time(settings.serial, kRead.size() + 3);
        const Duration reply = wire_time(settings.serial, kReply.size() + 3);
        const Duration needed = request + silent_interval(settings.serial) + reply;
        EXPECT_GE(room(job), needed) << baud;
        EXPECT_LE(room(job), needed + 1us) << baud;
    }
}

TEST_F(AdmissionTest, P3WhatHasNoKnownReplyHasToLeaveRoomForTheShortest) {
    const Settings settings = at(9600);
    const Bytes identify = "11"_hex;
    const Duration frames = wire_time(settings.serial, identify.size() + 3 + 5);
    EXPECT_EQ(room(stamped(settings, identify)), frames + silent_interval(settings.serial));
}

TEST_F(AdmissionTest, WhatTakesLongerHasToStartEarlier) {
    const Bytes write = Writer().u8(0x10).u16(0).u16(100).u8(200).raw(Bytes(200)).take();
    EXPECT_GT(room(stamped(at(9600), write)), room(stamped(at(9600), kRead)));
    EXPECT_GT(room(stamped(at(9600), "03 00 00 00 64"_hex)), room(stamped(at(9600), kRead)));
    EXPECT_GT(room(stamped(at(1200), kRead)), room(stamped(at(9600), kRead)));
}

TEST_F(AdmissionTest, ABroadcastOnlyHasToLeaveInTime) {
    const Bytes write = "06 00 6B 00 01"_hex;
    const Settings settings = at(9600);
    EXPECT_EQ(room(stamped(settings, write, 0)), wire_time(settings.serial, write.size() + 3));
}

TEST_F(AdmissionTest, P6MemoryAnswersOnlyReadsOfClientsAndWhereTheStationAllowsIt) {
    remember();
    Job job = job_of(kRead);
    const auto hit = admission_.from_memory(kNow + 1s, job, 1s);
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->hit.pdu, kReply);
    EXPECT_EQ(hit->hit.age, Duration(1s));
    EXPECT_FALSE(admission_.from_memory(kNow, job, 0s));
    EXPECT_FALSE(admission_.from_memory(kNow, job_of("06 00 6B 00 01"_hex), 1s));
    EXPECT_FALSE(admission_.from_memory(kNow, job_of(kRead, 18), 1s));
    job.priority = PriorityClass::poll;
    EXPECT_FALSE(admission_.from_memory(kNow, job, 1s));
}

}  // namespace
}  // namespace panelgate::arbiter::reception_test
