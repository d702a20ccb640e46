#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/arbiter/actions.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/bus/trace.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::bus {

/// What the clock on the wall showed at an instant. It is asked now and then, not each time: when
/// somebody sets it, this follows a moment later.
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

/// As TraceFrame, but for the words; its bytes are elsewhere.
struct RecordedFrame {
    std::uint64_t sequence = 0;
    TimePoint at;
    WallTime time{};
    std::uint64_t transaction = 0;
    std::uint64_t place = 0;
    std::uint16_t size = 0;
    FrameKind kind = FrameKind::request;
    arbiter::Reason why{};
};
struct RecordedDecision {
    std::uint64_t sequence = 0;
    TimePoint at;
    WallTime time{};
    std::uint64_t place = 0;
    std::size_t size = 0;
};
/// As TraceTransaction; its frames tell the rest.
struct RecordedTransaction : TransactionFacts {
    static constexpr std::uint64_t kOpen = UINT64_MAX;  ///< its end has no number yet

    RecordedTransaction() {
        sequence = kOpen;
        end = TransactionEnd::open;
    }
};

/// Frames, decisions and transactions of a line in memory of a fixed size. What is no longer whole
/// is not told: a frame gives way with its bytes, a transaction with its request.
class TraceStore {
  public:
    explicit TraceStore(const TraceSettings& settings);
    /// What one takes at most, in bytes; but for the names of clients, which it shares.
    static std::size_t memory(const TraceSettings& settings);

    void add(RecordedFrame frame, ByteView bytes);
    void add(RecordedDecision decision, std::string_view text);
    void add(const RecordedTransaction& transaction);
    /// The newest; null: none.
    RecordedTransaction* newest();
    /// Null: it is not remembered, or was never begun.
    RecordedTransaction* find(std::uint64_t id);
    /// Everything of `from` behind this sequence number, as it stands there.
    void copy(const TraceStore& from, std::uint64_t since);
    void clear();

    /// One more transaction with long frames would push nothing out.
    bool has_room() const;
    bool empty() const { return frames_.empty(); }
    /// Sequence number of the request of the transaction so many before the newest, or of the
    /// oldest; 0: none.
    std::uint64_t first_of_last(std::size_t count) const;

    // Oldest first; of the newest, or of those behind a number.
    std::vector<TraceFrame> frames(std::size_t last) const;
    std::vector<TraceFrame> frames_since(std::uint64_t sequence, std::size_t most) const;
    std::vector<TraceDecision> decisions(std::size_t last) const;
    std::vector<TraceDecision> decisions_since(std::uint64_t sequence, std::size_t most) const;
    /// Those that are over.
    std::vector<TraceTransaction> transactions(std::size_t last) const;
    std::vector<TraceTransaction> transactions_since(std::uint64_t sequence,
                                                     std::size_t most) const;
    // ... and all three kinds.
    TracePart part(std::size_t last) const;
    TracePart part_since(std::uint64_t sequence, std::size_t most) const;

  private:
    TraceFrame told(const RecordedFrame& frame) const;
    TraceDecision told(const RecordedDecision& decision) const;
    TraceTransaction told(const RecordedTransaction& transaction) const;
    template <class Told, class Recorded>
    std::vector<Told> in_words(const std::vector<Recorded>& recorded) const;
    std::size_t ended() const;
    void forget_torn();

    TraceSettings limits_;
    Recorder<RecordedFrame> frames_;
    Recorder<RecordedDecision> decisions_;
    Recorder<RecordedTransaction> transactions_;
    ByteRing bytes_;
    ByteRing text_;
};

/// Something went wrong on the line.
struct Trouble {
    TimePoint at;
    WallTime time{};
    std::optional<std::uint8_t> station{};  ///< nothing: the whole line
    std::string_view cause;                 ///< a literal
    bool news = true;  ///< false: it goes on as it did, and is no incident of its own
};

/// Keeps what happened around errors, the last of them, in memory of a fixed size: what stood in
/// the trace before the first, and what came behind the last. Pure.
class IncidentBook {
  public:
    explicit IncidentBook(const IncidentSettings& settings) : settings_(settings) {}

    /// `trace`: of the line, with what went wrong.
    void on_trouble(const Trouble& trouble, const TraceStore& trace);
    // What happens on the line, as it is recorded there: it belongs to the incident that is open.
    void begin(const RecordedTransaction& transaction);
    void add(const RecordedFrame& frame, ByteView bytes);
    void add(const RecordedDecision& decision, std::string_view text);
    void update(const RecordedTransaction& transaction);
    /// A transaction is over.
    void end(const RecordedTransaction& transaction);

    /// The oldest first.
    std::vector<IncidentHead> heads() const;
    /// One of them, which has been read then.
    std::optional<Incident> fetch(std::uint64_t id);

  private:
    struct Kept {
        IncidentHead head;
        TraceStore store;
    };
    void open(const Trouble& trouble, const TraceStore& trace);
    Kept& place();
    void close();

    IncidentSettings settings_;
    std::vector<std::unique_ptr<Kept>> kept_;  ///< the oldest first
    bool open_ = false;                        ///< the newest of them
    std::size_t left_ = 0;                     ///< transactions that still belong to it
    TimePoint until_{};                        ///< … and not later than this
    std::uint64_t count_ = 0;
};

/// What happened on a line, frames, decisions and ends of transactions in one sequence: kept for
/// those who ask, and told in the log at trace level. `settings` and `wall` outlive it.
class TraceBook {
  public:
    TraceBook(const Settings& settings, Wall& wall);

    /// A frame that was sent, or a master's request that was heard, begins a transaction.
    void note(arbiter::Note note);
    void decide(TimePoint at, const std::string& text);
    /// The transaction with this number is over; 0: the one that was begun last.
    void end(const arbiter::Exchange& exchange);
    /// Somebody is answered by this transaction; the first counts.
    void answered(arbiter::Transaction transaction, TimePoint at);
    void on_line_down(TimePoint at);

    const TraceStore& store() const { return store_; }
    IncidentBook& incidents() { return incidents_; }

  private:
    void begin(const arbiter::Note& note, const RecordedFrame& request);
    void judge(const RecordedTransaction& transaction, TimePoint at);
    bool is_stranger(std::uint8_t station) const;

    const Settings& settings_;
    Wall& wall_;
    std::uint64_t happened_ = 0;        ///< the last sequence number
    arbiter::Transaction current_ = 0;  ///< the last that was begun
    TraceStore store_;
    IncidentBook incidents_;
    std::array<TransactionEnd, 256> ends_{};  ///< of each station's last transaction
};

}  // namespace panelgate::bus
