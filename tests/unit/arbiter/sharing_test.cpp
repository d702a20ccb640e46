#include "panelgate/arbiter/schedule.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "support/hex.hpp"
#include "support/queue_fixture.hpp"

namespace panelgate::arbiter::sharing_test {
namespace {

Bytes registers(unsigned address, unsigned count) {
    return Writer().u8(3).u16(address).u16(count).take();
}

class SharingTest : public test::QueueFixture {
  protected:
    /// A station whose profile guarantees this many registers; 0: none does.
    static Station station_that_takes(std::uint16_t count) {
        StationSettings settings;
        settings.vouched = count > 0;
        if (count > 0) settings.max_registers = count;
        return {1, settings, OfflineSettings{}, true, 40ms};
    }
    Group gather(const Bytes& leader) { return gather(leader, station_); }
    Group gather(const Bytes& leader, const Station& station) {
        return sharing_.gather(TimePoint{1h}, read_of(9, leader), station, outstanding_, queue_);
    }
    void wait(const Bytes& pdu) { EXPECT_TRUE(queue_.push(read_of(++client_, pdu)).taken); }

    Outstanding outstanding_;
    Sharing sharing_{true};
    Station station_ = station_that_takes(125);
    Client client_ = 100;
};

TEST_F(SharingTest, P6ContainedReadsComeAlongAndTouchingOnesUpToWhatTheProfileVouchesFor) {
    struct Row {
        std::vector<Bytes> waiting;
        Bytes leader;
        std::uint16_t vouched;  ///< registers; 0: none
        std::size_t jobs;       ///< of the transaction
        Bytes request;
    };
    const Bytes other_table = "04 00 0C 00 01"_hex;
    const Bytes a_write = "06 00 0A 00 01"_hex;
    const Row rows[] = {
        // Contained reads, whatever is known of the station.
        {{registers(12, 3), registers(10, 10)}, registers(10, 10), 0, 3, registers(10, 10)},
        // A wider read, for which a client asked itself.
        {{registers(10, 10)}, registers(12, 2), 0, 2, registers(10, 10)},
        // Touching reads, also by a read between them.
        {{registers(14, 2), registers(12, 2)}, registers(10, 2), 125, 3, registers(10, 6)},
        // Nothing is read that no client asked for.
        {{registers(13, 2), other_table, a_write}, registers(10, 2), 125, 1, registers(10, 2)},
        // No longer read is made than the profile vouches for.
        {{registers(12, 2)}, registers(10, 2), 3, 1, registers(10, 2)},
        {{registers(12, 2)}, registers(10, 2), 4, 2, registers(10, 4)},
        {{registers(12, 2)}, registers(10, 2), 0, 1, registers(10, 2)},
    };
    for (const Row& row : rows) {
        queue_.remove_if(test::any);
        for (const Bytes& pdu : row.waiting) wait(pdu);
        const Group group = gather(row.leader, station_that_takes(row.vouched));
        EXPECT_EQ(group.jobs.size(), row.jobs);
        EXPECT_EQ(group.request.pdu(), row.request);
        const bool is_asked =
            row.request == row.leader || std::ranges::count(row.waiting, row.request) > 0;
        EXPECT_EQ(group.joined(), !is_asked);
        EXPECT_EQ(queue_.waiting(), row.waiting.size() + 1 - row.jobs);
    }
}

TEST_F(SharingTest, P6AJoinThatDidNotComeAboutIsRememberedAndItsPartsGoAlone) {
    wait(registers(12, 2));
    wait(registers(14, 2));
    Group group = gather(registers(10, 2));
    Jobs parts = sharing_.split(group);
    EXPECT_TRUE(group.jobs.empty());
    ASSERT_EQ(parts.size(), 3u);
    for (Job& part : parts) {
        EXPECT_TRUE(part.alone);
        queue_.put_back(std::move(part));
    }
    EXPECT_EQ(gather(registers(10, 6)).jobs.size(), 1u) << "they are to go alone";
    queue_.remove_if(test::any);
    wait(registers(12, 2));
    wait(registers(14, 2));
    EXPECT_LT(gather(registers(10, 2)).jobs.size(), 3u) << "the whole was refused";
}

TEST_F(SharingTest, P2ForAClientThatHasLeftNothingIsSentWhenAJoinIsSplit) {
    wait(registers(12, 2));
    wait(registers(14, 2));
    Group group = gather(registers(10, 2));
    ASSERT_TRUE(group.joined());
    group.on_client_gone(group.jobs[1].client);
    const Ticket gone = group.jobs[1].ticket;
    EXPECT_EQ(sharing_.split(group).size(), 2u);
    ASSERT_EQ(group.jobs.size(), 1u);
    EXPECT_EQ(group.jobs.front().ticket, gone);
}

TEST_F(SharingTest, P6EachGetsItsPartAndAllGetTheException) {
    wait(registers(12, 1));
    const Group group = gather(registers(10, 2));
    const Bytes reply = "03 06 00 0A 00 0B 00 0C"_hex;
    EXPECT_EQ(Sharing::part_for(group, reply, group.jobs[0]), "03 04 00 0A 00 0B"_hex);
    EXPECT_EQ(Sharing::part_for(group, reply, group.jobs[1]), "03 02 00 0C"_hex);
    for (const Job& job : group.jobs)
        EXPECT_EQ(Sharing::part_for(group, "83 06"_hex, job), "83 06"_hex);
}

}  // namespace
}  // namespace panelgate::arbiter::sharing_test
