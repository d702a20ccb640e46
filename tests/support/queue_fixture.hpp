#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "panelgate/arbiter/queue/job_queue.hpp"
#include "panelgate/base/bytes.hpp"
#include "support/request.hpp"

namespace panelgate::test {

using arbiter::Client;
using arbiter::Host;
using arbiter::Job;
using arbiter::JobQueue;
using arbiter::QueueSettings;
using arbiter::Ticket;

inline bool any(const Job& /*job*/) { return true; }

/// Every job reads or writes another address, unless it says otherwise.
class QueueFixture : public testing::Test {
  protected:
    Job job(Host host, Client client, std::uint8_t station, PriorityClass priority) {
        const unsigned address = 2 * static_cast<unsigned>(++ticket_ % 30000);
        const unsigned function = priority == PriorityClass::write ? 6 : 3;
        return {.ticket = ticket_,
                .station = station,
                .request = request_of(Writer().u8(function).u16(address).u16(1).take()),
                .client = client,
                .host = host,
                .priority = priority};
    }
    Job read(Client client, std::uint8_t station, Host host = 0) {
        return job(host, client, station, PriorityClass::read);
    }
    Job write(Client client, std::uint8_t station, Host host = 0) {
        return job(host, client, station, PriorityClass::write);
    }
    Job poll(Client client, std::uint8_t station, Host host = 0) {
        return job(host, client, station, PriorityClass::poll);
    }
    Job read_of(Client client, const Bytes& pdu) {
        Job made = read(client, 1);
        made.request = request_of(pdu);
        return made;
    }
    Ticket add(Job job) {
        const Ticket ticket = job.ticket;
        const auto admission = queue_.push(std::move(job));
        EXPECT_TRUE(admission.taken);
        EXPECT_TRUE(admission.shed.empty());
        return ticket;
    }
    /// Of the next one, 0 when none may run. What choose() shows is what comes.
    Ticket next(const JobQueue::Test& may_run = any) {
        const JobQueue::Choice choice = queue_.choose(may_run);
        if (choice.job() == nullptr) return 0;
        const Ticket ticket = choice.job()->ticket;
        EXPECT_EQ(queue_.take(choice).ticket, ticket);
        return ticket;
    }
    std::vector<Ticket> drain() {
        std::vector<Ticket> tickets;
        while (const Ticket ticket = next()) tickets.push_back(ticket);
        return tickets;
    }
    static std::vector<Ticket> tickets(const arbiter::Jobs& jobs) {
        std::vector<Ticket> all;
        for (const Job& job : jobs) all.push_back(job.ticket);
        return all;
    }
    void limits(std::size_t limit, std::size_t per_client) {
        queue_ = JobQueue(QueueSettings{.limit = limit, .per_client = per_client, .deadline = 2s});
    }

    JobQueue queue_{QueueSettings{}};
    Ticket ticket_ = 0;
};

}  // namespace panelgate::test
