#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client_names.hpp"
#include "panelgate/arbiter/actions.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/bus/trace.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::bus {

/// Converts instants to wall-clock time. Reads the wall clock at most every 100 ms, so it follows a
/// clock change with that delay.
class Wall {
  public:
    explicit Wall(rt::Clock& clock) : clock_(clock) {}

    WallTime at(TimePoint instant) {
        constexpr Duration kAgain = 100ms;
        if (instant >= asked_ + kAgain) {
            asked_ = clock_.now();
            shown_ = rt::wall_now();
        }
        return wall_time_of(instant, asked_, shown_);
    }

  private:
    rt::Clock& clock_;
    TimePoint asked_{};
    WallTime shown_{};
};

/// Like TraceFrame, but its bytes are in a ByteRing and its reason is not text.
struct RecordedFrame {
    std::uint64_t sequence = 0;
    TimePoint at;
    WallTime time{};
    std::uint64_t transaction = 0;
    std::uint64_t place = 0;
    std::uint16_t size = 0;
    FrameKind kind = FrameKind::request;
    arbiter::Reason why{};
    ClientName client{};  ///< that it was sent for
};
struct RecordedDecision {
    std::uint64_t sequence = 0;
    TimePoint at;
    WallTime time{};
    std::uint64_t place = 0;
    std::size_t size = 0;
};
/// Like TraceTransaction; the rest is in its frames.
struct RecordedTransaction : TransactionFacts {
    static constexpr std::uint64_t kOpen = UINT64_MAX;  ///< sequence of a transaction still open

    RecordedTransaction() {
        sequence = kOpen;
        end = TransactionEnd::open;
    }
};

/// Frames, decisions and transactions of a line in memory of a fixed size. Only complete records
/// are returned: a frame is dropped with its bytes, a transaction with its request.
class TraceStore {
  public:
    explicit TraceStore(const TraceSettings& settings);
    /// Returns the maximum size in bytes, without the clients' names, which are shared.
    static std::size_t memory(const TraceSettings& settings);

    void add(RecordedFrame frame, ByteView bytes);
    void add(RecordedDecision decision, std::string_view text);
    void add(const RecordedTransaction& transaction);
    /// Returns the newest transaction; null if there is none.
    RecordedTransaction* newest();
    /// Returns null if the transaction was dropped or never begun.
    RecordedTransaction* find(std::uint64_t id);
    /// Copies all records of `from` after this sequence number.
    void copy(const TraceStore& from, std::uint64_t since);
    void clear();

    /// True if one more transaction with long frames drops no record.
    bool has_room() const;
    bool empty() const { return frames_.empty(); }
    /// Returns the sequence number of the request of the last but `count` transaction, or of the
    /// oldest; 0 if there is none.
    std::uint64_t first_of_last(std::size_t count) const;

    /// Returns the last frames, decisions and finished transactions, oldest first, at most `last`
    /// of each.
    TracePart part(std::size_t last) const;
    /// Returns the first that follow a sequence number, oldest first, at most `most` of each.
    TracePart part_since(std::uint64_t sequence, std::size_t most) const;

  private:
    TraceFrame decoded(const RecordedFrame& frame) const;
    TraceDecision decoded(const RecordedDecision& decision) const;
    TraceTransaction decoded(const RecordedTransaction& transaction) const;
    template <class Recorded>
    auto decoded(const std::vector<Recorded>& recorded) const;
    std::size_t ended() const;
    void drop_incomplete();

    TraceSettings limits_;
    Recorder<RecordedFrame> frames_;
    Recorder<RecordedDecision> decisions_;
    Recorder<RecordedTransaction> transactions_;
    ByteRing bytes_;
    ByteRing text_;
};

/// An error on the line.
struct ErrorEvent {
    TimePoint at;
    WallTime time{};
    std::optional<std::uint8_t> station{};  ///< nullopt: the whole line
    std::string_view cause;                 ///< a string literal
    bool is_new = true;                     ///< false: a repetition, which opens no incident
};

/// Records what happened around errors in memory of a fixed size: the trace before the first error,
/// and what follows the last. Pure.
class IncidentBook {
  public:
    explicit IncidentBook(const IncidentSettings& settings) : settings_(settings) {}

    /// `trace`: of the line, including the error.
    void on_error(const ErrorEvent& error, const TraceStore& trace);
    // Records as they are added to the trace: they go to the open incident, if any.
    void begin(const RecordedTransaction& transaction);
    void add(const RecordedFrame& frame, ByteView bytes);
    void add(const RecordedDecision& decision, std::string_view text);
    void update(const RecordedTransaction& transaction);
    /// A transaction has ended.
    void end(const RecordedTransaction& transaction);

    /// The oldest first.
    std::vector<IncidentHead> heads() const;
    /// Returns an incident and marks it as read.
    std::optional<Incident> fetch(std::uint64_t id);

  private:
    struct Kept {
        IncidentHead head;
        TraceStore store;
    };
    void open(const ErrorEvent& error, const TraceStore& trace);
    Kept& place();
    void close();

    IncidentSettings settings_;
    std::vector<std::unique_ptr<Kept>> kept_;  ///< the oldest first
    bool open_ = false;                        ///< the newest incident is open
    std::size_t left_ = 0;                     ///< transactions still to be added to it
    TimePoint until_{};                        ///< … and not later than this
    std::uint64_t count_ = 0;
};

/// Records a line's frames, decisions and transaction ends in one sequence, and logs them at trace
/// level. `settings` and `wall` outlive it.
class TraceBook {
  public:
    TraceBook(const Settings& settings, Wall& wall);

    /// A sent frame, or a request heard from another master, begins a transaction. `client`: for
    /// whom it was sent.
    void note(arbiter::Note note, ClientName client = {});
    void decide(TimePoint at, const std::string& text);
    /// Ends the transaction with this number; 0: the last one begun.
    void end(const arbiter::Exchange& exchange);
    /// A request was answered by this transaction; only the first answer is recorded.
    void answered(arbiter::Transaction transaction, TimePoint at);
    void on_line_down(TimePoint at);
    /// Gives back the memory of what was recorded; numbers go on.
    void clear();

    const TraceStore& store() const { return store_; }
    IncidentBook& incidents() { return incidents_; }

  private:
    void begin(const arbiter::Note& note, const RecordedFrame& request);
    void judge(const RecordedTransaction& transaction, TimePoint at);
    bool is_unlisted(std::uint8_t station) const;

    const Settings& settings_;
    Wall& wall_;
    std::uint64_t sequence_ = 0;        ///< last sequence number
    arbiter::Transaction current_ = 0;  ///< last transaction begun
    TraceStore store_;
    IncidentBook incidents_;
    std::array<TransactionEnd, 256> ends_{};  ///< of each station's last transaction
};

}  // namespace panelgate::bus
