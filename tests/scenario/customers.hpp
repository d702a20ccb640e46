#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include "agenda.hpp"
#include "checker.hpp"
#include "plan.hpp"
#include "random.hpp"
#include "subject.hpp"

namespace panelgate::scenario {

/// The clients behind the arbiter: each keeps some requests open, and may leave at any moment.
class Customers {
  public:
    /// `reach` calls the arbiter as soon as it can be called, and drains it.
    using Reach = std::function<void(std::function<void()>)>;

    Customers(const Plan& plan, Agenda& agenda, Subject& subject, Random& random, Checker& checker,
              Reach reach, std::function<bool()> is_over);

    void start();
    void on_finish(arbiter::Ticket ticket);
    /// Requests that wait for their answer.
    bool are_waiting() const { return !asked_by_.empty(); }

  private:
    struct Customer {
        ClientPlan plan;
        arbiter::Client id = 0;
        unsigned scanned = 0;
    };
    void become(Customer& customer);
    void leave(std::size_t index);
    void leave_some_time(std::size_t index);
    void ask(std::size_t index);
    void submit(std::size_t index);
    arbiter::Job draw_job(Customer& customer);
    Bytes draw_read(const Customer& customer);
    Bytes draw_write();

    const Plan& plan_;
    Agenda& agenda_;
    Subject& subject_;
    Random& random_;
    Checker& checker_;
    Reach reach_;
    std::function<bool()> is_over_;
    std::vector<Customer> customers_;
    std::map<arbiter::Ticket, std::size_t> asked_by_;
    arbiter::Client last_client_ = 0;
    unsigned last_write_ = 0;
};

}  // namespace panelgate::scenario
