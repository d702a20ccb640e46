#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <tuple>

#include "panelgate/arbiter/queue/job.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/inline_function.hpp"
#include "panelgate/base/pool.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::arbiter {

/// Items of one table (01..04) of one station, as a read asks for them.
struct ReadSpan {
    std::uint8_t station = 0;
    modbus::Span items;

    bool same_table(const ReadSpan& other) const {
        return station == other.station && items.table == other.items.table;
    }
    bool contains(const ReadSpan& other) const {
        return station == other.station && items.contains(other.items);
    }
    friend bool operator==(const ReadSpan&, const ReadSpan&) = default;
};

/// Returns the part of a reply to `whole` that answers `part`, which `whole` contains, as a PDU.
Bytes slice_reply(const modbus::Span& whole, ByteView reply, const modbus::Span& part);

/// Values read on one line, for stations with `max_age`. The oldest is dropped first. Pure.
class ReadCache {
  public:
    static constexpr std::size_t kEntries = 256;

    struct Hit {
        Bytes pdu;  ///< reply to the read that was asked for
        Duration age{};
    };

    /// Stores the normal reply to `span`, read by a request that left at `sampled` or later. Not if
    /// a write came since: the order of the two is unknown.
    void store(const ReadSpan& span, Bytes reply, TimePoint sampled);
    /// Returns the newest value of all these items that is not older than max_age.
    std::optional<Hit> find(const ReadSpan& span, TimePoint now, Duration max_age) const;
    /// A write to the station (0: all), answered or not: drops what modbus::may_change() names.
    void on_write(TimePoint now, std::uint8_t station, const modbus::Request& request);
    void clear() { entries_.clear(); }
    std::size_t size() const { return entries_.size(); }

  private:
    struct Entry {
        ReadSpan span;
        Bytes reply;
        TimePoint sampled;
    };
    PoolList<Entry> entries_;                    ///< newest first
    std::map<std::uint8_t, TimePoint> written_;  ///< last write to each station; 0: all stations
};

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
    /// True if removing this read lowers the count: no carried read would take its place.
    bool frees(Ticket ticket, const ReadSpan& span) const;
    /// Visits the client of each waiting read of this station.
    template <class Visit>
    void visit(std::uint8_t station, const Visit& visit) const {
        auto it = spans_.lower_bound({station, {modbus::kTables.front(), 0, 0x10000}});
        for (; it != spans_.end() && it->first.station == station; ++it)
            for (const auto& [ticket, client] : it->second) visit(client);
    }
    /// Number of reads that count.
    std::size_t counting() const { return widest_.size(); }

  private:
    /// A span inside a wider span comes behind the wider span, or behind a span that begins inside.
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
    /// Widest spans: no waiting span contains another of these, so ends rise with beginnings.
    PoolMap<Place, ReadSpan> widest_;
};

}  // namespace panelgate::arbiter
