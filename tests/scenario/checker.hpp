#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_set>
#include <vector>

#include "costs.hpp"
#include "panelgate/arbiter/arbiter.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "plan.hpp"
#include "truth.hpp"
#include "watch.hpp"
#include "witness.hpp"

namespace panelgate::scenario {

/// Holds what an arbiter does against what it promises. Knows the truth (what the panels did and
/// when) from the world and the claims (answers, frames) from the arbiter; shares no code with it.
///
/// In a world of threats nothing passes but what has no sign on the wire:
///   - A good CRC by chance: nobody has said these bytes (Truth::is_chance()).
///   - A copy of a reply that has the form of the awaited one, before a copy came while its panel
///     was not asked: from then on the panel is known (T12). The answer that the copy displaces
///     comes one late (on_copy()).
/// In the world of a limit wrong values are counted (wrong_values()); all other promises hold.
class Checker : public Witness {
  public:
    explicit Checker(const Plan& plan);
    Checker(const Checker&) = delete;
    Checker& operator=(const Checker&) = delete;

    // Claims
    void on_accepted(TimePoint now, arbiter::Ticket ticket, const arbiter::Job& job);
    void on_refused(TimePoint now, const arbiter::Job& job, Fault fault);
    /// `what`: the word of its note. `dead`: no panel can hear it.
    void on_transmit(TimePoint now, const Bytes& adu, FrameKind what, bool dead);
    void on_finish(TimePoint now, const arbiter::Finish& finish);
    /// All that it had to say to a new request has been said.
    void on_settled();
    /// It asks for the same instant again and again.
    void on_spin() { fail("it spins: its deadline passes and nothing changes"); }
    // Truth
    void on_heard(TimePoint now, std::size_t bytes);
    /// A good answer of this station was delivered to its last byte: to the request on the wire, if
    /// that asks it.
    void on_answered(TimePoint now, std::uint8_t station);
    void on_served(TimePoint now, std::uint8_t station) override { truth_.on_served(now, station); }
    void on_executed(TimePoint now, std::uint8_t station, ByteView pdu) override {
        truth_.on_executed(now, station, pdu);
    }
    void on_exception(TimePoint now, std::uint8_t station, ByteView pdu) override {
        truth_.on_exception(now, station, pdu);
    }
    void on_copy(TimePoint now, ByteView adu) override;
    void on_reply(TimePoint now, ByteView adu) override;
    void on_said(TimePoint now, ByteView bytes) override { truth_.on_said(now, bytes); }
    void on_garbled(TimePoint now) override { garbled_ = now; }
    void on_collision(TimePoint now, std::uint8_t station) override;
    void on_line_down(TimePoint now);
    void on_line_up(TimePoint now);
    void on_stall(TimePoint now) { watch_.on_upset(now); }
    /// Nobody called the arbiter between these two.
    void on_paused(TimePoint from, TimePoint now);
    void on_client(arbiter::Client client, const ClientPlan& plan);
    void on_client_gone(arbiter::Client client);
    /// Nothing more happens: everything must be answered.
    void at_end(TimePoint now);

    bool failed() const { return !violation_.empty(); }
    /// The first one, "P1: …".
    const std::string& violation() const { return violation_; }
    /// In the world of a limit: answers whose value or confirmation is none, and the first one.
    std::uint64_t wrong_values() const { return wrong_values_; }
    const std::string& wrong_value() const { return wrong_value_; }
    std::uint64_t good_answers() const { return good_; }
    std::uint64_t frames() const { return frames_; }
    std::uint64_t collisions() const { return collisions_; }
    double good_share(TimePoint now) const { return costs_.good_share(now - started_); }
    /// Copies that came instead of an answer before anybody could know that this panel says its
    /// replies twice.
    std::uint64_t first_copies() const { return first_copies_; }
    /// Those of them that no gateway can know.
    std::uint64_t excused() const { return excused_; }
    /// Answers of which nobody has said the like, and whose CRC was right by chance.
    std::uint64_t lucky() const { return lucky_; }
    /// How long requests to sound panels have waited for their answers, hit ones too.
    const std::vector<Duration>& waits() const { return waits_; }
    /// The longest that each station was not asked.
    const std::map<std::uint8_t, Duration>& longest_unasked() const { return longest_unasked_; }
    /// The longest silence while a request waited that nothing kept from going.
    Duration longest_idle() const { return longest_idle_; }

  private:
    struct Open {
        arbiter::Job job;
        TimePoint submitted;
        std::uint64_t served = 0;  ///< by its station, when it was submitted
        std::uint64_t turn = 0;    ///< turns until then
        bool write = false;
        bool sent = false;  ///< in a frame, and not known to wait again
        bool gone = false;  ///< its client
        /// It was not answered with the frame that it was taken to be in: that was a part of a
        /// joined read, which goes alone, or the joined read itself, and has failed.
        bool again = false;
        std::optional<arbiter::ReadSpan> span{};  ///< of a read of a table
    };
    struct Client {
        std::map<std::uint8_t, TimePoint> own_write;  ///< executed and confirmed, by station
        std::uint64_t accepted = 0;
        std::uint64_t good = 0;
        unsigned open = 0;
        bool healthy = false;  ///< none of its stations is ever dead
        bool polite = false;
        bool single = false;     ///< one request at a time
        TimePoint held_until{};  ///< the last fault of one that was silent, or rested
    };

    void fail(std::string what);
    void fail_value(std::string what);
    void close_attempt(TimePoint now);
    // What may be sent when (checker_wire.cpp)
    void check_moment(TimePoint now);
    void check_idling(TimePoint now);
    bool looks_late(std::uint8_t station) const;
    void check_write_sent(std::uint8_t station, ByteView pdu);
    void check_again(std::uint8_t station, ByteView pdu, FrameKind what);
    void check_crc(const Bytes& adu);
    TimePoint behind_broadcasts(const Open& open) const;
    std::optional<TimePoint> good_work_since(TimePoint since) const;
    TimePoint rests_for(const Open& open) const;
    bool is_noisy(TimePoint now) const;
    Duration least_wait() const;
    const arbiter::StationSettings& settings_of(std::uint8_t station) const;
    Duration latest_reply(std::uint8_t station) const;
    TimePoint owed_until() const;
    // Who waits, and whose turn it is (checker_queue.cpp)
    void mark_sent(std::uint8_t station, ByteView pdu, FrameKind what);
    void mark_answered(std::uint8_t station);
    bool joins_attempt(TimePoint now, const arbiter::Job& job) const;
    std::size_t waiting(arbiter::Ticket but_for = 0) const;
    void check_turn(TimePoint now, bool write);
    // What may be answered (checker.cpp)
    void check_reply(TimePoint now, const Open& open, const arbiter::Finish& finish);
    void check_values(TimePoint now, const Open& open, const arbiter::Finish& finish);
    Bytes heard_for(const Open& open, const Bytes& reply) const;
    bool is_behind_first_copy(TimePoint now, std::uint8_t station) const;
    bool is_luck(ByteView heard);
    void check_write(TimePoint now, const Open& open, const Bytes& reply);
    void check_fault(TimePoint now, const Open& open, Fault fault);
    void check_in_time(TimePoint now, const Open& open, const arbiter::Finish& finish);
    Duration gap() const;

    Plan plan_;
    const arbiter::Settings& settings_;
    bool calm_ = false;
    bool echoes_ = false;  ///< or one panel repeats requests, as an adapter does that hears itself
    std::string violation_;
    std::string wrong_value_;
    std::uint64_t wrong_values_ = 0;
    std::vector<std::string> too_soon_;  ///< writes that were confirmed and not yet executed
    Truth truth_;
    Watch watch_;
    Costs costs_;
    std::map<arbiter::Ticket, Open> open_;
    arbiter::Ticket last_ticket_ = 0;
    std::uint64_t frames_settled_ = 0;  ///< frames_ when everything had settled last
    bool came_ = false;                 ///< a newcomer that was taken
    bool displaced_ = false;            ///< somebody had to go for it
    std::map<arbiter::Client, Client> clients_;
    std::map<std::string, int> written_;             ///< times that each write was on the wire
    std::unordered_set<std::string> closed_writes_;  ///< answered, or of nobody any more
    std::map<std::string, arbiter::Ticket> open_writes_;
    std::unordered_set<std::uint8_t> repeat_writes_;   ///< stations that allow it
    std::unordered_set<std::uint8_t> known_doublers_;  ///< were heard to say a reply twice
    std::map<std::uint8_t, TimePoint> replied_;        ///< each station, the last time
    std::map<std::uint8_t, Bytes> said_;               ///< its last answer that was heard whole
    std::map<std::uint8_t, TimePoint> said_at_;
    std::unordered_set<std::uint8_t> retried_;  ///< whose last request was a retry
    std::map<std::uint8_t, Bytes> asked_;       ///< what each station was asked last
    std::map<Bytes, TimePoint> spread_;  ///< when broadcasts had left, by what would answer them
    std::map<std::uint8_t, TimePoint> excused_from_;  ///< see on_copy()
    /// Until when the reply may come that a refusal for being busy has announced, by the station
    /// and the function.
    std::map<std::pair<std::uint8_t, std::uint8_t>, TimePoint> announced_;
    std::uint64_t first_copies_ = 0;
    std::uint64_t excused_ = 0;
    TimePoint garbled_{};
    TimePoint retry_from_{};   ///< until then only those who waited before the silence go first
    std::uint64_t lucky_ = 0;  ///< see is_luck()
    Attempt attempt_;
    std::map<std::uint8_t, bool> silent_before_;               ///< each station's transaction began
    std::unordered_set<std::uint8_t> silent_to_reads_before_;  ///< likewise
    TimePoint sent_until_{};
    TimePoint heard_until_{};
    TimePoint noisy_since_{};  ///< no silence since then
    TimePoint last_transmit_{};
    TimePoint paused_from_{};
    TimePoint resumed_{};
    std::uint64_t last_read_turn_ = 0;
    std::deque<TimePoint> last_turns_;  ///< when the last transactions began
    std::uint64_t turns_ = 0;
    TimePoint started_{};
    std::uint64_t good_ = 0;
    std::uint64_t frames_ = 0;
    std::uint64_t collisions_ = 0;
    std::vector<Duration> waits_;
    std::map<std::uint8_t, TimePoint> last_asked_;
    std::map<std::uint8_t, Duration> longest_unasked_;
    Duration longest_idle_{};
};

}  // namespace panelgate::scenario
