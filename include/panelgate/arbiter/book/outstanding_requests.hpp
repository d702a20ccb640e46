#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/pool.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::arbiter {

/// A request that was asked on the line, by whomever, and what became of it.
struct BookEntry {
    enum class State : std::uint8_t {
        outstanding,    ///< its attempt has ended without its reply, which may still come
        passed,         ///< ... but a later one was answered, and stations serve in order
        lapsed,         ///< ... but its window is over
        damaged,        ///< its reply came damaged, and may come again
        answered,       ///< lately
        refused,        ///< none: an exception came that was asked for by nobody
        foreign,        ///< another master's
        maybe_foreign,  ///< ... which may be a reply as well
        broadcast,      ///< has no reply, and panels that answer all the same
    };
    State state = State::outstanding;
    TimePoint sent{};  ///< its last bit; of another master's: when it was heard
    Bytes pdu{};
    TimePoint replied{};
    Bytes reply{};           ///< of a broadcast: the normal one
    bool followed = false;   ///< a frame of the form of its reply came behind that; of another
                             ///< master's: its answer
    bool announced = false;  ///< an exception has announced its reply: the next one is not its
    bool outdated = false;   ///< of a read: what it reads has been written since it left

    /// When it came to be what it is.
    TimePoint since() const { return sent < replied ? replied : sent; }
};

/// What a good frame of a station may be, as far as the book can tell.
struct Claims {
    bool contested = false;          ///< an answer to what may be another master's request
    bool other_master = false;       ///< an answer to another master's request
    bool outstanding = false;        ///< to an outstanding request
    bool other_outstanding = false;  ///< ... which is not the open one
    bool closed = false;             ///< to one that has passed or lapsed
    bool passed = false;             ///< to one that has passed and is not the open one
    bool outdated = false;           ///< ... but a read of the same, before that was written
    bool repeats = false;            ///< a recent reply once more
    bool repeats_other = false;      ///< ... to a request that is not the open one
    bool repeats_refusal = false;    ///< a recent exception that nobody had asked for
    bool has_last_form =
        false;             ///< of that of the last reply, soon after it; false with an open request
    TimePoint repeated{};  ///< when the latest reply that it repeats came
};

/// The book of one line: every request that may still be answered, or was answered lately, by
/// station and in the order in which it was entered (P1). Whose a reply is (claims) and whether
/// another's could be taken for it (is_ambiguous) are one question asked twice, and are answered
/// here for whoever is on the line: the arbiter, and the tap beside another master. Its one rule of
/// order: a station serves what it gets over one connection in turn. tests/model has the same rules
/// apart from the code. Bounded. Pure.
class OutstandingRequests {
  public:
    static constexpr std::size_t kMost = 16;    ///< outstanding, of a station
    static constexpr std::size_t kReplies = 8;  ///< remembered, of a station: the last ones, and
                                                ///< the last one of each function
    static constexpr std::size_t kForeign = 8;  ///< other masters' requests, to a station
    static constexpr std::size_t kBroadcasts = 16;

    /// `most`: outstanding requests of a station; the oldest is forgotten beyond that.
    explicit OutstandingRequests(std::size_t most = kMost) : most_(most) {}

    // Acceptance

    /// What was asked before these times is no longer answered.
    struct Windows {
        TimePoint outstanding = TimePoint::min();
        TimePoint closed = TimePoint::min();
        TimePoint passed = TimePoint::min();
        TimePoint contested = TimePoint::min();
        TimePoint foreign = TimePoint::max();  ///< of another master
    };
    /// What this frame of a station may be. `reply`: without address and CRC. `open`: the PDU
    /// of the request that waits for its reply; empty: none.
    Claims claims(TimePoint now, std::uint8_t station, ByteView reply, const Windows& windows,
                  ByteView open = {}) const;
    /// How long after the last broadcast that this frame may answer it has come; empty: it answers
    /// none.
    std::optional<Duration> behind_broadcast(TimePoint now, ByteView reply) const;
    /// The first outstanding request that this reply may answer and that left later than `open`,
    /// else the last that it may answer; null: it answers none.
    const BookEntry* first(std::uint8_t station, ByteView reply,
                           TimePoint open = TimePoint::min()) const;
    /// True if a request of another function is outstanding.
    bool has_other_function(std::uint8_t station, std::uint8_t function) const;
    /// When this reply last came before `before`, of those that are recent at `now`; {}: it did
    /// not.
    TimePoint given(std::uint8_t station, TimePoint now, ByteView reply,
                    TimePoint before = TimePoint::max()) const;
    /// The last reply that came before `before`; null: none is known.
    const BookEntry* last_reply(std::uint8_t station, TimePoint before = TimePoint::max()) const;
    /// Returns a recent reply that occurs again, as a good frame, inside damaged bytes; or nullptr.
    const Bytes* given_in(TimePoint now, std::uint8_t station, ByteView bytes,
                          modbus::CrcOrder order) const;
    /// Returns a reply to an outstanding request inside damaged bytes, but none that equals its
    /// request, which may be our own frame; or {}.
    ByteView late_in(ByteView bytes, const modbus::CrcOrders& orders) const;

    // Admission

    bool any(std::uint8_t station) const {
        return station < pages_.size() && pages_[station].outstanding > 0;
    }
    std::size_t count(std::uint8_t station) const { return of(station).outstanding; }
    /// True if one is outstanding that left at `since` or later.
    bool any_since(std::uint8_t station, TimePoint since) const {
        return any(station) && last_sent(station) >= since;
    }
    /// True if the reply to one was announced: it comes later, out of turn.
    bool any_announced(std::uint8_t station) const;
    /// When the first and the last of the outstanding left; there must be one.
    TimePoint first_sent(std::uint8_t station) const;
    TimePoint last_sent(std::uint8_t station) const;
    /// When the first equal request left that may still be answered, and left later than `open`.
    std::optional<TimePoint> first_asked(std::uint8_t station, ByteView pdu, TimePoint open) const;
    /// True if some are outstanding, and all of them are this request.
    bool is_only(std::uint8_t station, const Bytes& pdu) const;
    /// True if a normal reply to an outstanding request could be taken for the reply to this one:
    /// same function, and same length or echoed fields. An exception may answer any request of its
    /// function: claims() tells whose it is. `again`: it is a retry, which its own earlier attempts
    /// may answer.
    bool is_ambiguous(std::uint8_t station, const modbus::Request& request,
                      bool again = false) const;
    /// True if the last reply to this request came damaged, and nothing was asked since.
    bool came_damaged(std::uint8_t station, const Bytes& pdu) const;
    /// Time from which no reply to a broadcast can be taken for the reply to `request`. `window`:
    /// how long after a broadcast its station may answer it; `refuses`: also by an exception, which
    /// any request of the same function may have.
    TimePoint broadcasts_over(const modbus::Request& request, Duration window, bool refuses) const;

    // A connection that may delay frames and deliver them later proves nothing by being accepted:
    // requests sent on the one before may be served, and answered, after that.

    void on_opened(TimePoint now) { opened_ = now; }
    /// A request that was started then has been answered.
    void on_proved(TimePoint started) { proved_ = proved_ < started ? started : proved_; }
    /// Requests sent before this time left over an earlier connection.
    TimePoint opened() const { return opened_; }
    /// Requests sent before this time have been delivered.
    TimePoint proved() const { return proved_; }

    // Entries

    /// `announced`: by an exception.
    void on_unanswered(std::uint8_t station, TimePoint sent, const Bytes& pdu,
                       bool announced = false);
    /// An exception announces the reply to the first outstanding request that it may answer.
    void announce(std::uint8_t station, ByteView exception);
    /// This write leaves (station 0: to all), answered or not: replies to reads of what it may
    /// change that are still to come are older.
    void on_written(std::uint8_t station, ByteView write);
    /// Its reply came, but damaged.
    void on_damaged(std::uint8_t station, TimePoint sent, const Bytes& pdu);
    void forget_damaged(std::uint8_t station);
    void on_reply(std::uint8_t station, TimePoint now, const Bytes& pdu, ByteView reply);
    /// Something of the form of the last reply came behind it. Returns true if that has happened to
    /// another of the last replies, too.
    bool on_followed(std::uint8_t station);
    /// An exception that nobody had asked for; the first of equal ones counts.
    void on_refusal(std::uint8_t station, TimePoint now, ByteView reply);
    /// The bytes begin with another master's request. `maybe`: or with a reply.
    void on_foreign(TimePoint now, ByteView bytes, bool maybe);
    /// This answered the oldest of another master's requests that it fits. False: there is none.
    bool on_foreign_answered(std::uint8_t station, ByteView reply);
    /// What they have asked of it so far is over.
    void on_foreign_over(std::uint8_t station);
    void on_broadcast(TimePoint sent, const Bytes& pdu);

    /// A request that left at `sent` was served: those before it on its connection have passed,
    /// except those whose reply was announced.
    void pass(std::uint8_t station, TimePoint sent);
    /// This reply came: takes out the first request that it may answer; those before it on its
    /// connection have passed. Does nothing if what it may answer left over the present connection
    /// and over an earlier one: their order is unknown. `asked`: a request that it may answer, too,
    /// has left over the present one and is not among these.
    void close(std::uint8_t station, ByteView reply, bool asked);
    /// ... takes out that alone: the station does not serve in order.
    void take(std::uint8_t station, ByteView reply);
    /// Takes out the first that has passed or lapsed, left later than `open` and may be answered by
    /// this; there must be one.
    BookEntry take_closed(std::uint8_t station, ByteView reply, TimePoint open);
    /// True if a request that left later than `open` has passed or lapsed, and the very same was
    /// then answered with this: it may be the first one's reply. Takes that out.
    bool take_first_of_two(std::uint8_t station, ByteView reply, TimePoint open);
    /// Takes out the oldest outstanding.
    void take_first(std::uint8_t station) { take_first(at(station)); }
    /// No reply can come any more to what left before this, as far as is known.
    void lapse(std::uint8_t station, TimePoint before = TimePoint::max());
    /// All outstanding replies have come.
    void settle(std::uint8_t station);
    /// The line was lost: what others have asked is of no interest any more.
    void forget_foreign();
    void forget(std::uint8_t station);

  private:
    struct Page {
        PoolVector<BookEntry> asked;
        std::size_t outstanding = 0;
    };
    const Page& of(std::uint8_t station) const;
    Page& at(std::uint8_t station);
    /// Enters one; of its state the page keeps `most`, and forgets the oldest beyond that.
    static void enter(Page& page, BookEntry one, std::size_t most);
    static void take_first(Page& page);
    static BookEntry* oldest_reply(Page& page, std::uint8_t function);
    /// The outstanding ones that left before `before`, and not before `since`, are so now.
    static void close(Page& page, BookEntry::State state, TimePoint since, TimePoint before);

    std::size_t most_;
    PoolVector<Page> pages_;  ///< by station; 0: broadcasts
    TimePoint opened_{};
    TimePoint proved_{};
};

}  // namespace panelgate::arbiter
