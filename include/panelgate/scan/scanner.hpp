#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/scan/options.hpp"
#include "panelgate/scan/report.hpp"

namespace panelgate::scan {

struct SetFormat {
    SerialFormat format;
};
struct Transmit {
    ReadRequest request;
    SerialMode mode = SerialMode::rtu;  ///< that of the format
};
/// Returns the bytes to write at once.
Bytes on_wire(const Transmit& transmit);
using Action = std::variant<SetFormat, Transmit>;

/// Looks for stations on one line: listens, finds the serial format, asks every station, recognises
/// panels and duplicate addresses by their answers. Pure: time and bytes in, actions out. The line
/// must be open and used by this scanner only. Early or repeated calls of on_deadline() are
/// harmless. Memory is bounded by the number of stations and profiles.
class Scanner {
  public:
    /// `profiles` outlives it.
    Scanner(const profile::Catalogue& profiles, Settings settings, TimePoint now);
    ~Scanner();
    Scanner(const Scanner&) = delete;
    Scanner& operator=(const Scanner&) = delete;

    void on_rx(TimePoint now, ByteView bytes);
    void on_deadline(TimePoint now);
    /// Sets the latency that the transport adds to every answer.
    void set_latency(Duration latency);

    std::optional<Action> poll_action();
    std::optional<TimePoint> next_deadline() const;

    bool done() const;
    /// "3 found, 45 questions left at most: 38400 8N1, station 17".
    std::string progress() const;
    /// Returns the stations examined so far, in the order of their examinations.
    const std::vector<StationFinding>& examined() const;
    /// Returns what is known so far, also before it is done.
    Result result() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace panelgate::scan
