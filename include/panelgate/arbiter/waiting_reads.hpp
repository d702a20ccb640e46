#pragma once

#include <cstddef>
#include <cstdint>
#include <tuple>

#include "panelgate/arbiter/job.hpp"
#include "panelgate/arbiter/read_cache.hpp"
#include "panelgate/base/inline_function.hpp"
#include "panelgate/base/pool.hpp"

namespace panelgate::arbiter {

/// The waiting reads that could share a transaction, by span. Of the reads that one transaction
/// answers only one counts: the oldest of a span that no other waiting span contains; the others
/// are carried. Owned by the queue, which counts; every change is reported to it.
class WaitingReads {
  public:
    /// Adds to the number of this client's reads that count.
    using Count = InlineFunction<void(Client, int), 16>;

    /// True if a waiting span contains this one.
    bool carries(const ReadSpan& span) const;
    void add(const Job& job, const ReadSpan& span, const Count& count);
    void remove(const Job& job, const ReadSpan& span, const Count& count);
    /// True if this waiting read counts.
    bool counts(Ticket ticket, const ReadSpan& span) const;
    /// True if removing this read lowers the count: it counts, and no carried read would take its
    /// place.
    bool frees(Ticket ticket, const ReadSpan& span) const;
    /// Number of reads that count.
    std::size_t counting() const { return widest_.size(); }
    /// Checks consistency by recomputing. For tests.
    bool consistent() const;

  private:
    /// Spans within another come directly after it, or after others that begin inside it.
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
    /// Spans that no other contains, so their ends rise as they begin.
    PoolMap<Place, ReadSpan> widest_;
};

}  // namespace panelgate::arbiter
