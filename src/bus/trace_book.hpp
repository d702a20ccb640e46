#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "incident_book.hpp"
#include "panelgate/arbiter/actions.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/transaction_end.hpp"
#include "panelgate/bus/bus.hpp"
#include "trace_store.hpp"
#include "wall.hpp"

namespace panelgate::bus {

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
