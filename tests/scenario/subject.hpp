#pragma once

#include <memory>
#include <optional>

#include "panelgate/arbiter/arbiter.hpp"

namespace panelgate::scenario {

/// What is tried: the arbiter as it is, or one that a test has broken on purpose.
class Subject {
  public:
    explicit Subject(const arbiter::Settings& settings)
        : arbiter_(std::make_unique<arbiter::Arbiter>(settings)) {}
    virtual ~Subject() = default;

    virtual Result<arbiter::Ticket> submit(TimePoint now, arbiter::Job job) {
        return arbiter_->submit(now, std::move(job));
    }
    virtual void cancel(TimePoint now, arbiter::Client client) { arbiter_->cancel(now, client); }
    virtual void on_rx(TimePoint now, ByteView bytes) { arbiter_->on_rx(now, bytes); }
    virtual void on_deadline(TimePoint now) { arbiter_->on_deadline(now); }
    virtual std::optional<arbiter::Action> poll_action(TimePoint now) {
        static_cast<void>(now);
        return arbiter_->poll_action();
    }
    virtual std::optional<TimePoint> next_deadline() const { return arbiter_->next_deadline(); }
    std::optional<TimePoint> busy_until() const { return arbiter_->busy_until(); }
    virtual std::size_t queue_depth() const { return arbiter_->queue_depth(); }
    virtual void on_line_up(TimePoint now) { arbiter_->on_line_up(now); }
    virtual void on_line_down(TimePoint now) { arbiter_->on_line_down(now); }
    void check_invariants() const { arbiter_->check_invariants(); }

  protected:
    std::unique_ptr<arbiter::Arbiter> arbiter_;
};

}  // namespace panelgate::scenario
