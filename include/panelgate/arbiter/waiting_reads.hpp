#pragma once

#include <cstddef>
#include <cstdint>
#include <tuple>

#include "panelgate/arbiter/job.hpp"
#include "panelgate/arbiter/read_cache.hpp"
#include "panelgate/base/inline_function.hpp"
#include "panelgate/base/pool.hpp"

namespace panelgate::arbiter {

/// The reads that wait and could share a transaction, by what they ask for. Of those that one
/// transaction answers only one counts: the oldest of a span that no other waiting span contains;
/// the others ride. Owned by the queue, which counts; every change of who counts is told.
class WaitingReads {
  public:
    /// This client has so many more, or fewer, that count.
    using Count = InlineFunction<void(Client, int), 16>;

    /// A read of this span would ride.
    bool carries(const ReadSpan& span) const;
    void add(const Job& job, const ReadSpan& span, const Count& count);
    void remove(const Job& job, const ReadSpan& span, const Count& count);
    /// Of one that waits: it counts.
    bool counts(Ticket ticket, const ReadSpan& span) const;
    /// It counts, and without it nobody else would count in its place.
    bool frees(Ticket ticket, const ReadSpan& span) const;
    /// How many count.
    std::size_t counting() const { return widest_.size(); }
    /// Checks itself the slow way, for tests.
    bool consistent() const;

  private:
    /// All within one span come directly behind it, or behind another that begins inside it.
    struct WiderFirst {
        bool operator()(const ReadSpan& a, const ReadSpan& b) const;
    };
    using Equals = PoolMap<Ticket, Client>;  ///< never empty, the oldest may count
    using Spans = PoolMap<ReadSpan, Equals, WiderFirst>;
    using Place = std::tuple<std::uint8_t, modbus::Table, std::uint32_t>;

    static Place place(const ReadSpan& span) {
        return {span.station, span.items.table, span.items.first};
    }
    bool is_widest(const ReadSpan& span) const;
    void make_widest(Spans::const_iterator it, const Count& count);
    void drop_span(Spans::iterator it, const Count& count);

    Spans spans_;
    /// Those that no other contains. None contains another, so their ends rise as they begin.
    PoolMap<Place, ReadSpan> widest_;
};

}  // namespace panelgate::arbiter
