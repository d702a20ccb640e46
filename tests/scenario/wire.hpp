#pragma once

#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <vector>

#include "agenda.hpp"
#include "plan.hpp"
#include "random.hpp"
#include "witness.hpp"

namespace panelgate::scenario {

/// Something that somebody puts on the wire.
struct Said {
    Bytes bytes;
    double rate = 1;           ///< a character takes this much longer than the line's
    std::uint8_t station = 0;  ///< whose transaction it is part of; 0 = nobody's
    /// Where the good answer to the request lies, whole and undamaged; nowhere: both 0.
    std::size_t answer_from = 0;
    std::size_t answer_to = 0;
    bool copy = false;            ///< it was said before
    bool damaged = false;         ///< not what its speaker meant
    std::size_t hole_before = 0;  ///< this byte comes later by
    Duration hole{};
    std::uint64_t connection = 0;  ///< it is heard on this one only
};

/// A half-duplex wire and the way from it to the gateway. Whoever speaks while another speaks
/// damages both.
class Wire {
  public:
    /// Bytes reach the gateway; `answer_of`: the station whose good answer has come to its last
    /// byte, or 0.
    using Hear = std::function<void(ByteView bytes, std::uint8_t answer_of)>;
    /// A request has left undamaged, on this connection.
    using Ask = std::function<void(ByteView adu, std::uint64_t connection)>;
    /// Somebody else than the gateway begins to speak.
    using Begin = std::function<void()>;

    Wire(const Plan& plan, Agenda& agenda, Random& random, Witness& witness)
        : plan_(plan), agenda_(agenda), random_(random), witness_(witness) {}
    void connect(Hear hear, Ask ask, Begin begin = [] {}) {
        hear_ = std::move(hear);
        ask_ = std::move(ask);
        begin_ = std::move(begin);
    }

    /// The gateway sends.
    void send(Bytes adu);
    /// Anybody else speaks, now. When it ends.
    TimePoint say(Said said);
    /// Only the gateway hears it, and only when nobody speaks.
    void whisper(Bytes bytes);
    Duration time_of(std::size_t characters, double rate) const;

    bool is_up() const { return up_; }
    /// When the request began that has ended now.
    TimePoint asked_since() const { return asked_since_; }
    std::uint64_t connection() const { return connection_; }
    void go_down() { up_ = false; }
    /// Nothing that was said before, or is said in answer to something sent before, is heard.
    void forget_connection() { ++connection_; }
    void come_up() { up_ = true; }
    /// Nothing gets through in either direction; then all of it, in order.
    void stall(TimePoint until);
    TimePoint stalled_until() const { return stalled_until_; }
    /// Since when nobody has spoken; never in the future.
    bool is_quiet_for(Duration silence) const;

  private:
    struct Frame : Said {
        TimePoint start;
        TimePoint end;
        std::optional<TimePoint> garbled_from;
        TimePoint end_of(std::size_t byte, const Wire& wire) const;
    };
    using FramePtr = std::shared_ptr<Frame>;
    struct Held {
        Bytes bytes;
        std::uint8_t answer_of = 0;
        std::uint64_t connection = 0;
        Bytes copy{};   ///< the answer that is said again, and ends here
        Bytes reply{};  ///< the answer that ends here
    };

    FramePtr put(Said said);
    void leave(Bytes adu, std::uint64_t connection);
    void leave_in_turn(Held held);
    void echo(const FramePtr& frame);
    void hand_over(const Frame& request);
    void deliver_in_chunks(const FramePtr& frame);
    void deliver(const FramePtr& frame, std::size_t from, std::size_t to);
    void empty_buffer();
    void garble(Frame& frame, std::size_t from, std::size_t to);
    void arrive(Held held);
    void release();

    const Plan& plan_;
    Agenda& agenda_;
    Random& random_;
    Witness& witness_;
    Hear hear_;
    Ask ask_;
    Begin begin_;
    std::list<FramePtr> air_;
    TimePoint spoken_until_{};
    TimePoint whispered_until_{};
    TimePoint stalled_until_{};
    TimePoint says_held_until_{};  ///< what a stall has held back, and what came since
    TimePoint asked_since_{};
    Bytes last_reply_;  ///< of the odd panel
    TimePoint handed_over_{};
    FramePtr buffered_;  ///< a part of our own frame that an adapter has not handed over yet
    std::vector<Held> held_in_;
    std::vector<Held> held_out_;
    std::uint64_t connection_ = 1;
    bool up_ = true;
};

}  // namespace panelgate::scenario
