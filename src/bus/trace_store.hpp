#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "panelgate/arbiter/reason.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/frame_kind.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/transaction_end.hpp"
#include "panelgate/base/wall_time.hpp"
#include "panelgate/bus/flight_recorder.hpp"
#include "panelgate/bus/trace.hpp"

namespace panelgate::bus {

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

}  // namespace panelgate::bus
