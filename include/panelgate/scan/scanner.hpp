#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <variant>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/scan/progress.hpp"
#include "panelgate/scan/result.hpp"
#include "panelgate/scan/settings.hpp"

namespace panelgate::scan {

struct SetFormat {
    SerialFormat format;
};
struct Transmit {
    ReadRequest request;
    SerialMode mode = SerialMode::rtu;  ///< that of the format
};
/// What is to be written, in one piece.
Bytes on_wire(const Transmit& transmit);
using Action = std::variant<SetFormat, Transmit>;

/// Looks for stations on one line: listens, finds the serial format, asks every station, tells
/// panels and doubled addresses by what they answer. Pure: time and bytes in, actions out; the line
/// is its alone and open. Calling on_deadline() early or twice is harmless. Memory is bounded by
/// the number of stations and profiles.
class Scanner {
  public:
    /// `profiles` outlive it.
    Scanner(const profile::Catalogue& profiles, Settings settings, TimePoint now);
    ~Scanner();
    Scanner(const Scanner&) = delete;
    Scanner& operator=(const Scanner&) = delete;

    void on_rx(TimePoint now, ByteView bytes);
    void on_deadline(TimePoint now);
    /// What the way to the line and back adds to every answer.
    void set_latency(Duration latency);

    std::optional<Action> poll_action();
    std::optional<TimePoint> next_deadline() const;

    bool done() const;
    Progress progress(TimePoint now) const;
    /// Also before it is done: what is known so far.
    Result result() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace panelgate::scan
