#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "few.hpp"
#include "judge.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "rules.hpp"
#include "subject.hpp"
#include "support/bus_step.hpp"

namespace panelgate::explorer {

/// One state of a small world: an arbiter, two panels that serve their requests in order, at most
/// two replies on their way from each. A value: it is copied, and moved on by one move.
class World {
  public:
    /// `told`: the settings that the subject believes in. Both must outlive it and its copies.
    World(const Rules& rules, const arbiter::Settings& told, Flaw flaw);

    using Moves = Few<Move, 48>;
    Moves moves() const;
    void play(Move move);
    /// Nobody says anything any more: all must be answered, and the arbiter come to rest.
    void run_on();
    std::string_view violation() const { return judge_.violation(); }
    int faults() const { return faults_; }
    /// Of everything that can be seen from outside, times counted from now on, and of what cannot:
    /// the arbiter's own digest, or how it goes on when everybody asks and nobody answers.
    std::uint64_t digest() const;
    std::string describe(Move move) const;
    /// From now on, what is done is written there.
    void record(std::vector<test::BusStep>* steps) { steps_ = steps; }

  private:
    /// A request that a panel has, and its reply.
    struct Reply {
        std::array<std::uint8_t, 6> adu{};  ///< of the request, without CRC
        TimePoint asked{};                  ///< the request's last bit
        /// Where a request may be held back: it had reached its panel by then, because one that was
        /// sent later was answered. Nothing is held back for ever behind it.
        TimePoint reached{};
        std::uint16_t served = 0;  ///< the number of this service, once asked
        std::uint8_t passed = 0;   ///< bytes of the reply that have come
        bool probe = false;
    };
    using Replies = Few<Reply, 2>;
    /// What may be expected of the patience with a panel (P4).
    struct Known {
        Duration needed{};  ///< the longest of its replies took so long to begin; 0: none came
        bool unanswered = false;  ///< what was sent to it last
        bool silent = false;      ///< what was sent before that
    };

    Bytes bytes_of(const Reply& reply) const;
    TimePoint ready(const Reply& reply) const;
    TimePoint last_moment(const Reply& reply) const;
    bool comes_in_time(const Reply& reply) const;
    void add_submits(Moves& moves) const;
    void add_replies(Moves& moves) const;
    void add_noise(Moves& moves) const;
    bool allows(Verb verb) const;
    Duration half_way() const;
    std::uint64_t prospect() const;

    void submit(const Wish& wish);
    void leave(std::uint8_t client);
    void deliver(Verb verb, std::uint8_t station);
    void check_answered(const Reply& reply, const Judge::Opens& before);
    static bool is_asked(const Judge::Open& open, const Reply& reply);
    void pass_on(TimePoint asked);
    bool is_the_answer(const Reply& reply) const;
    Duration patience(const Reply& reply) const;
    /// Its reply has begun, and the silence since then is no longer than a hole may be.
    bool is_in_hole() const { return begun_ && now_ < begun_at_ + rules_->settings.reply_hole; }
    void noise(Verb verb);
    void blink(bool keeps);
    void say(ByteView bytes);
    void hear(ByteView bytes);
    void advance(TimePoint to);
    void serve();
    void drain();
    void act(const arbiter::Transmit& transmit);
    void act(const arbiter::Finish& finish);
    void act(const arbiter::Note& note);
    void act(const arbiter::Reset&) { reset_ = true; }
    void act(const arbiter::Exchange&) {}
    void act(const arbiter::Written&) {}
    void act(const arbiter::Decision&) {}
    void act(const arbiter::StationEvent&) {}
    void note(test::BusStep step) {
        if (steps_ != nullptr) steps_->push_back(std::move(step));
    }

    const Rules* rules_;
    Subject subject_;
    Judge judge_;
    TimePoint now_{1h};
    std::array<Replies, 3> replies_;  ///< by station
    std::array<Known, 3> known_;      ///< by station
    TimePoint last_start_{};          ///< of the request sent last
    std::array<std::uint8_t, 6> last_sent_{};
    bool clean_ = false;     ///< nothing was heard since then, and the line stayed
    bool begun_ = false;     ///< nothing but the beginning of its reply…
    TimePoint begun_at_{};   ///< …and when that ended
    bool probing_ = false;   ///< the next frame is for nobody
    bool reset_ = false;     ///< the arbiter wants the line closed
    std::uint8_t gone_ = 0;  ///< bits of clients
    std::uint16_t writes_ = 0;
    int faults_ = 0;
    bool was_half_ = false;  ///< the last move
    std::vector<test::BusStep>* steps_ = nullptr;
};

}  // namespace panelgate::explorer
