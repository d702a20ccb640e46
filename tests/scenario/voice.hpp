#pragma once

#include <vector>

#include "panelgate/arbiter/settings.hpp"
#include "plan.hpp"
#include "random.hpp"
#include "wire.hpp"

namespace panelgate::scenario {

/// One piece of what a panel says.
struct Utterance {
    Duration pause{};  ///< after the piece before
    Said said;
};

/// How one panel's answers sound on the wire: everything that is wrong with them but their moment.
class Voice {
  public:
    Voice(const PanelPlan& plan, const arbiter::Settings& line, Random& random)
        : plan_(plan), line_(line), random_(random) {}

    /// All that is said for this reply. `spare`: what may be said besides must have ended after
    /// this long, else it could outlast the late window of the request (see draw_line).
    std::vector<Utterance> speak(const Bytes& reply_pdu, Duration spare);
    /// Some text that nobody asked for, as boot loaders say it.
    Said text();

  private:
    Said said(Bytes bytes) const;
    Bytes random_bytes(unsigned least, unsigned most);
    std::uint8_t glitch();
    void add_preface(std::vector<Utterance>& all, const Bytes& reply, Duration spare);
    void add_epilogue(std::vector<Utterance>& all, const Bytes& reply, const Bytes& good);
    Bytes of_another(Bytes reply) const;
    Said main_part(const Bytes& reply, const Bytes& good);
    Bytes damage(Bytes adu);
    Duration time_of(std::size_t bytes) const;

    PanelPlan plan_;
    const arbiter::Settings& line_;
    Random& random_;
};

}  // namespace panelgate::scenario
