#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>

#include "panelgate/arbiter/arbiter.hpp"

namespace panelgate::scenario {

/// One request of a client of a sound plant.
struct SoundRequest {
    std::uint64_t number = 0;
    std::uint64_t client = 0;
    std::uint8_t station = 1;
    Bytes pdu;
};

/// A gateway between the clients and the line of a sound plant, in virtual time.
class SoundMaster {
  public:
    /// What the gateway does to the plant. No callback calls the gateway again.
    struct Callbacks {
        std::function<void(const Bytes& adu)> transmit;
        /// `reply`: the panel's, or none. `alone`: the request went to the wire and shared no
        /// transaction.
        std::function<void(std::uint64_t number, const std::optional<Bytes>& reply, bool alone)>
            finish;
        std::function<void(std::uint8_t station)> offline;
        std::function<void()> reset;  ///< the connection is to be closed and opened again
        std::function<void(std::string_view what, ByteView bytes)> tell;
    };

    virtual ~SoundMaster() = default;
    virtual void submit(TimePoint now, SoundRequest request) = 0;
    virtual void on_rx(TimePoint now, ByteView bytes) = 0;
    virtual void on_deadline(TimePoint now) = 0;
    virtual void on_line_up(TimePoint now) = 0;
    virtual void on_line_down(TimePoint now) = 0;
    virtual std::optional<TimePoint> next_deadline() const = 0;
};

/// The arbiter of panelgate.
class PanelgateMaster : public SoundMaster {
  public:
    PanelgateMaster(const arbiter::Settings& settings, Callbacks act)
        : arbiter_(settings), act_(std::move(act)) {}

    void submit(TimePoint now, SoundRequest request) override;
    void on_rx(TimePoint now, ByteView bytes) override;
    void on_deadline(TimePoint now) override;
    void on_line_up(TimePoint now) override;
    void on_line_down(TimePoint now) override;
    std::optional<TimePoint> next_deadline() const override { return arbiter_.next_deadline(); }

  private:
    void drain();
    void act(const arbiter::Transmit& transmit) { act_.transmit(transmit.adu); }
    void act(const arbiter::Finish& finish);
    void act(const arbiter::StationEvent& event);
    void act(const arbiter::Note& note) { act_.tell(label(note.kind), note.bytes); }
    void act(const arbiter::Reset& reset);
    void act(const arbiter::Decision&) {}
    void act(const arbiter::Written&) {}
    void act(const arbiter::Exchange&) {}

    arbiter::Arbiter arbiter_;
    Callbacks act_;
    std::map<arbiter::Ticket, std::uint64_t> numbers_;
};

/// A plain gateway, as mbusd is: one request after the other in the order of their arrival. Each
/// request is waited for as long as `response_timeout`, and a read is sent once more.
class PlainMaster : public SoundMaster {
  public:
    PlainMaster(const arbiter::Settings& settings, Callbacks act)
        : settings_(settings), act_(std::move(act)) {}

    void submit(TimePoint now, SoundRequest request) override;
    void on_rx(TimePoint now, ByteView bytes) override;
    void on_deadline(TimePoint now) override;
    void on_line_up(TimePoint now) override { start(now); }
    void on_line_down(TimePoint) override {}
    std::optional<TimePoint> next_deadline() const override;

  private:
    void start(TimePoint now);
    void send(TimePoint now);
    std::optional<Bytes> reply() const;
    void finish(TimePoint now, const std::optional<Bytes>& reply);

    arbiter::Settings settings_;
    Callbacks act_;
    std::deque<SoundRequest> queue_;  ///< while attempts_ > 0 the front is on the wire
    int attempts_ = 0;
    Bytes heard_;
    TimePoint deadline_{};    ///< of the reply to the request on the wire
    TimePoint rest_until_{};  ///< the silent interval behind the last byte
};

}  // namespace panelgate::scenario
