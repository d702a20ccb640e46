#pragma once

#include <deque>
#include <optional>

#include "subject.hpp"

namespace panelgate::sound {

/// A plain gateway, as mbusd is: one request after the other in the order of their arrival. Each
/// request is waited for as long as `response_timeout`, and a read is sent once more.
class PlainGateway : public scenario::Subject {
  public:
    explicit PlainGateway(const arbiter::Settings& settings)
        : Subject(settings), settings_(settings) {}

    Result<arbiter::Ticket> submit(TimePoint now, arbiter::Job job) override;
    void on_rx(TimePoint now, ByteView bytes) override;
    void on_deadline(TimePoint now) override;
    void on_line_up(TimePoint now) override { start(now); }
    void on_line_down(TimePoint) override {}
    std::optional<arbiter::Action> poll_action(TimePoint now) override;
    std::optional<TimePoint> next_deadline() const override;

  private:
    void start(TimePoint now);
    void send(TimePoint now);
    std::optional<Bytes> reply() const;
    void finish(TimePoint now, Result<Bytes> pdu);

    arbiter::Settings settings_;
    std::deque<arbiter::Action> actions_;
    std::deque<arbiter::Job> queue_;  ///< while attempts_ > 0 the front is on the wire
    arbiter::Ticket last_ticket_ = 0;
    int attempts_ = 0;
    Bytes heard_;
    TimePoint deadline_{};    ///< of the reply to the request on the wire
    TimePoint rest_until_{};  ///< the silent interval behind the last byte
};

}  // namespace panelgate::sound
