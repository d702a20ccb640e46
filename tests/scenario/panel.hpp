#pragma once

#include <array>
#include <optional>
#include <vector>

#include "checker.hpp"
#include "plan.hpp"
#include "random.hpp"

namespace panelgate::scenario {

/// Something a panel puts on the wire.
struct Utterance {
    TimePoint at;
    Bytes bytes;
    /// It is the good answer to the request, whole and undamaged.
    bool answer = false;
};

/// One simulated panel in virtual time, with its faults. Tells the checker what it really did.
class Panel {
  public:
    Panel(const PanelPlan& plan, const arbiter::Settings& line, Random& random, Checker& checker);

    /// A frame for this panel (or a broadcast) has ended at `now`, undamaged.
    std::vector<Utterance> hear(TimePoint now, ByteView adu);
    bool is_dead(TimePoint now) const;
    std::uint8_t id() const { return plan_.id; }

  private:
    Bytes serve(TimePoint now, ByteView pdu);
    Bytes read(ByteView pdu);
    void write(TimePoint now, ByteView pdu);
    Duration think();
    Bytes damage(Bytes adu);

    PanelPlan plan_;
    arbiter::Settings line_;
    Random& random_;
    Checker& checker_;
    std::uint64_t served_ = 0;
    std::array<std::uint16_t, kMemoryCells + 2> cells_{};
    TimePoint busy_until_{};  ///< with what it says; a later request is answered behind that
};

}  // namespace panelgate::scenario
