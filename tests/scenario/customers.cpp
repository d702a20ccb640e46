#include "customers.hpp"

#include <utility>

#include "panelgate/modbus/request.hpp"
#include "support/request.hpp"

namespace panelgate::scenario {

Customers::Customers(const Plan& plan, Agenda& agenda, Subject& subject, Random& random,
                     Checker& checker, Reach reach, std::function<bool()> is_over)
    : plan_(plan),
      agenda_(agenda),
      subject_(subject),
      random_(random),
      checker_(checker),
      reach_(std::move(reach)),
      is_over_(std::move(is_over)) {
    for (const ClientPlan& client : plan_.clients) customers_.push_back({client, 0, 0});
}

void Customers::start() {
    for (std::size_t i = 0; i < customers_.size(); ++i) {
        become(customers_[i]);
        for (unsigned k = 0; k < customers_[i].plan.in_flight; ++k)
            agenda_.at(agenda_.now(), [this, i] { ask(i); });
        if (customers_[i].plan.leaves > 0) leave_some_time(i);
    }
}

void Customers::become(Customer& customer) {
    customer.id = ++last_client_;
    checker_.on_client(customer.id, customer.plan);
}

void Customers::leave(std::size_t index) {
    Customer& gone = customers_[index];
    const arbiter::Client left = std::exchange(gone.id, 0);
    become(gone);
    reach_([this, left] {
        subject_.cancel(agenda_.now(), left);
        checker_.on_client_gone(left);
    });
}

void Customers::leave_some_time(std::size_t index) {
    const double mean = 1 / customers_[index].plan.leaves;
    const Duration wait = random_.between(
        0us, std::chrono::duration_cast<Duration>(std::chrono::duration<double>(2 * mean)));
    agenda_.at(agenda_.now() + wait, [this, index] {
        if (is_over_()) return;
        leave(index);
        leave_some_time(index);
    });
}

void Customers::ask(std::size_t index) {
    if (is_over_()) return;
    reach_([this, index] { submit(index); });
}

void Customers::submit(std::size_t index) {
    const unsigned writes = last_write_;
    const arbiter::Job job = draw_job(customers_[index]);
    const auto ticket = subject_.submit(agenda_.now(), job);
    if (!ticket) {
        checker_.on_refused(agenda_.now(), job, ticket.error());
        // Refused at once: it comes again after a pause, not in the same instant. The number of
        // the write is free again: there are 65536.
        last_write_ = writes;
        agenda_.at(agenda_.now() + random_.between(1ms, 50ms), [this, index] { ask(index); });
        return;
    }
    agenda_.tell("request " + std::to_string(*ticket) + " of client " + std::to_string(job.client) +
                     " to station " + std::to_string(job.station),
                 job.request.pdu());
    checker_.on_accepted(agenda_.now(), *ticket, job);
    asked_by_[*ticket] = index;
}

void Customers::on_finish(arbiter::Ticket ticket) {
    const auto found = asked_by_.find(ticket);
    if (found == asked_by_.end()) return;
    const std::size_t index = found->second;
    asked_by_.erase(found);
    if (is_over_()) return;
    const ClientPlan& plan = customers_[index].plan;
    const TimePoint next = agenda_.now() + random_.between(0us, plan.pause);
    if (random_.chance(plan.vanish)) agenda_.at(agenda_.now(), [this, index] { leave(index); });
    agenda_.at(next, [this, index] { ask(index); });
}

arbiter::Job Customers::draw_job(Customer& customer) {
    const ClientPlan& plan = customer.plan;
    arbiter::Job job{.request = modbus::Request::read({modbus::Table::holding_registers, 0, 1}),
                     .client = customer.id,
                     .host = plan.host};
    if (plan.scans) {
        job.station = static_cast<std::uint8_t>(customer.scanned++ % 247 + 1);
    } else if (random_.chance(plan.broadcasts)) {
        job.station = 0;
        job.request = test::request_of(draw_write());
    } else {
        job.station = plan.stations[random_.below(static_cast<unsigned>(plan.stations.size()))];
        job.request =
            test::request_of(random_.chance(plan.writes) ? draw_write() : draw_read(customer));
    }
    job.priority = !job.request.is_read() ? PriorityClass::write
                   : plan.polls           ? PriorityClass::poll
                                          : PriorityClass::read;
    return job;
}

/// Few addresses, so that reads are equal, contained and adjacent often.
Bytes Customers::draw_read(const Customer& customer) {
    constexpr unsigned kBusyCells = 16;
    if (customer.plan.same_read) return Writer().u8(3).u16(0).u16(10).take();
    const unsigned function = random_.chance(0.8) ? 3 : 4;
    if (random_.chance(0.3)) {
        return Writer()
            .u8(3)
            .u16(kMemory + random_.below(kBusyCells))
            .u16(random_.between(1, 2))
            .take();
    }
    // One length more often than others: only what has the same shape can be mistaken.
    const unsigned count = random_.chance(0.5) ? 4 : random_.between(1, 20);
    return Writer().u8(function).u16(10 * random_.below(12)).u16(count).take();
}

/// Every write is another one, so that one that comes twice is seen.
Bytes Customers::draw_write() {
    constexpr unsigned kBusyCells = 16;
    constexpr unsigned kMost = 123;
    const unsigned id = ++last_write_ & 0xFFFF;
    const unsigned cell = kMemory + random_.below(kBusyCells);
    if (random_.chance(0.4)) return Writer().u8(5).u16(id).u16(0xFF00).take();
    if (random_.chance(0.5)) return Writer().u8(6).u16(cell).u16(id).take();
    if (random_.chance(0.95))
        return Writer().u8(16).u16(cell).u16(2).u8(4).u16(id).u16(~id & 0xFFFF).take();
    Writer longest;
    longest.u8(16).u16(kMemory).u16(kMost).u8(2 * kMost);
    // No later write of one register finds its value there.
    for (unsigned i = 0; i < kMost; ++i) longest.u16(~(id + i) & 0xFFFF);
    return longest.take();
}

}  // namespace panelgate::scenario
