#pragma once

#include <array>
#include <deque>
#include <map>
#include <set>
#include <vector>

#include "agenda.hpp"
#include "plan.hpp"
#include "random.hpp"
#include "truth.hpp"
#include "voice.hpp"
#include "wire.hpp"
#include "witness.hpp"

namespace panelgate::scenario {

/// One simulated panel in virtual time: serves one request after another, each at its own pace.
/// Tells a witness what it really did.
class Panel {
  public:
    Panel(const PanelPlan& plan, const Plan& all, Agenda& agenda, Wire& wire, Random& random,
          Witness& witness);
    Panel(const Panel&) = delete;
    Panel& operator=(const Panel&) = delete;

    /// What it does unasked.
    void start();
    /// A request has ended now, undamaged. True if this panel takes it for one of its own, or a
    /// broadcast.
    bool takes(ByteView adu);
    /// Somebody else than the gateway begins to speak.
    void overhear();
    /// It has taken this.
    void hear(ByteView adu, std::uint64_t connection);
    bool is_dead() const;
    std::uint8_t id() const { return plan_.id; }

  private:
    struct Request {
        Bytes pdu;
        TimePoint arrived;
        std::uint64_t connection = 0;
    };
    void serve_next();
    void begin(Request request);
    bool is_silent_to(unsigned registers) const;
    void answer(const Request& request, const Bytes& reply);
    void say_all(std::vector<Utterance> all, std::size_t next, std::uint64_t connection);
    void answer_broadcast(ByteView pdu, std::uint64_t connection);
    void imitate(const Request& request, Duration thinking);
    Bytes serve(ByteView pdu);
    Bytes refuse(ByteView pdu, unsigned code);
    Bytes confirm(ByteView pdu);
    void refuse_first(const Request& request, std::vector<Utterance>& all);
    Bytes read(ByteView pdu) const;
    void write(ByteView pdu);
    /// From now until it begins to speak.
    Duration think(const Request& request);
    Duration horizon() const;
    void reboot();

    PanelPlan plan_;
    const arbiter::Settings& line_;
    Agenda& agenda_;
    Wire& wire_;
    Random& random_;
    Witness& witness_;
    Voice voice_;
    std::uint64_t served_ = 0;
    std::array<std::uint16_t, kMemoryCells + 2> cells_{};
    std::set<std::uint16_t> coils_;  ///< that are on
    std::deque<Request> waiting_;
    bool busy_ = false;
    TimePoint dark_until_{};
    TimePoint imitated_{};
    TimePoint answer_ends_ = TimePoint::max();  ///< of what it is saying
    TimePoint replied_{};                       ///< its last answer ended
    TimePoint expects_until_{};  ///< another station's reply: PanelPlan::expects_replies
    std::map<std::uint8_t, Bytes> confirmed_;  ///< the last write of each function
    Bytes last_reply_;
};

}  // namespace panelgate::scenario
