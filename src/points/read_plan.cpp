#include "panelgate/points/read_plan.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <map>
#include <tuple>

#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::points {

namespace {

/// True if the want is valid, as Want requires.
bool is_plannable(const Want& want) {
    const modbus::Span& span = want.span;
    return span.count > 0 && span.first < modbus::kTableItems &&
           span.count <= modbus::kTableItems - span.first && want.every > Duration::zero();
}

/// How far reads of one table may extend, given readable areas and wants.
class TableMap {
  public:
    TableMap(std::span<const Want> wants, const PlanLimits& limits, modbus::Table table)
        : max_items_(limits.of(table).max_items) {
        std::vector<std::pair<std::uint32_t, std::uint32_t>> all;
        for (const profile::AddressRange& range : limits.of(table).readable)
            all.emplace_back(range.first, range.last + 1);
        for (const Want& want : wants)
            if (want.span.table == table && is_plannable(want))
                all.emplace_back(want.span.first, want.span.end());
        std::ranges::sort(all);
        std::uint32_t* last_end = nullptr;
        for (const auto& [first, end] : all) {
            if (last_end == nullptr || first > *last_end)
                last_end = &(open_[first] = end);
            else
                *last_end = std::max(*last_end, end);
        }
    }

    /// Returns the maximum end (one past the last item) of a read from `first`, which must be
    /// wanted or readable.
    std::uint32_t reach(std::uint32_t first) const {
        const auto after = open_.upper_bound(first);
        const std::uint32_t end = first + max_items_;
        return after == open_.begin() ? end : std::min(end, std::prev(after)->second);
    }

  private:
    std::uint32_t max_items_;
    std::map<std::uint32_t, std::uint32_t> open_;  ///< ends by starts; disjoint, never adjacent
};

/// A want, or a part of one.
struct Piece {
    std::uint32_t first = 0;
    std::uint32_t end = 0;
    Duration every{};
    std::size_t want = 0;
};

void cut(const Want& want, std::size_t index, std::uint32_t max_items, std::vector<Piece>& out) {
    const std::uint32_t end = want.span.end();
    for (std::uint32_t first = want.span.first; first < end; first += max_items)
        out.push_back({first, std::min(end, first + max_items), want.every, index});
}

void sort_by_start(std::vector<Piece>& pieces) {
    std::sort(pieces.begin(), pieces.end(), [](const Piece& a, const Piece& b) {
        return std::tie(a.first, b.end, a.every, a.want) <
               std::tie(b.first, a.end, b.every, b.want);
    });
}

/// A read that has no wants assigned yet.
struct Box {
    std::uint32_t first = 0;
    std::uint32_t end = 0;
    Duration every{};

    bool serves(const Piece& piece) const {
        return first <= piece.first && piece.end <= end && every <= piece.every;
    }
};

void sort_by_start(std::vector<Box>& boxes) {
    std::sort(boxes.begin(), boxes.end(), [](const Box& a, const Box& b) {
        return std::tie(a.first, b.end, a.every) < std::tie(b.first, a.end, b.every);
    });
}

/// Plans one table.
class TablePlanner {
  public:
    TablePlanner(std::span<const Want> wants, const PlanLimits& limits, modbus::Table table)
        : limits_(limits), table_(table), map_(wants, limits, table) {
        const std::uint32_t max_items = limits.of(table).max_items;
        for (std::uint32_t count = 0; count <= max_items; ++count)
            seconds_.push_back(to_seconds(read_cost(limits, table, count)));
        for (std::size_t i = 0; i < wants.size(); ++i)
            if (wants[i].span.table == table && is_plannable(wants[i]))
                cut(wants[i], i, max_items, pieces_);
        sort_by_start(pieces_);
    }

    std::vector<PlannedRead> run() const {
        std::vector<Box> boxes = plan_by_interval();
        if (has_intervals()) {
            std::vector<Box> together = plan_runs(pieces_);
            if (load(together) < load(boxes)) boxes = std::move(together);
        }
        std::vector<PlannedRead> reads = serve(std::move(boxes));
        for (PlannedRead& read : reads) {
            std::sort(read.wants.begin(), read.wants.end());
            read.wants.erase(std::unique(read.wants.begin(), read.wants.end()), read.wants.end());
        }
        std::sort(reads.begin(), reads.end(), [](const PlannedRead& a, const PlannedRead& b) {
            return std::tie(a.span.first, b.span.count, a.every) <
                   std::tie(b.span.first, a.span.count, b.every);
        });
        return reads;
    }

  private:
    bool has_intervals() const {
        return std::any_of(pieces_.begin(), pieces_.end(), [&](const Piece& piece) {
            return piece.every != pieces_.front().every;
        });
    }

    double load(const Box& box) const {
        return seconds_[box.end - box.first] / to_seconds(box.every);
    }
    double load(const std::vector<Box>& boxes) const {
        double sum = 0;
        for (const Box& box : boxes) sum += load(box);
        return sum;
    }

    /// Returns the cheapest partition of sorted pieces into runs: best[i] is the minimum load of
    /// all pieces from i. For pieces of one interval it is the cheapest of all partitions: without
    /// contained pieces, starts and ends both ascend, and any part of an allowed read is allowed.
    std::vector<Box> plan_runs(const std::vector<Piece>& sorted) const {
        const std::vector<Piece> pieces = without_contained(sorted);
        std::vector<double> best(pieces.size() + 1, std::numeric_limits<double>::infinity());
        std::vector<Box> first_box(pieces.size());
        std::vector<std::size_t> next(pieces.size());
        best[pieces.size()] = 0;
        for (std::size_t i = pieces.size(); i-- > 0;) {
            const std::uint32_t reach = map_.reach(pieces[i].first);
            Box box{pieces[i].first, pieces[i].end, pieces[i].every};
            for (std::size_t j = i; j < pieces.size() && pieces[j].end <= reach; ++j) {
                box.end = std::max(box.end, pieces[j].end);
                box.every = std::min(box.every, pieces[j].every);
                const double total = load(box) + best[j + 1];
                if (total > best[i]) continue;
                best[i] = total;
                first_box[i] = box;
                next[i] = j + 1;
            }
        }
        std::vector<Box> boxes;
        for (std::size_t i = 0; i < pieces.size(); i = next[i]) boxes.push_back(first_box[i]);
        return boxes;
    }

    /// Removes pieces contained in another piece with the same or a shorter interval.
    static std::vector<Piece> without_contained(const std::vector<Piece>& sorted) {
        std::vector<Piece> kept;
        std::map<Duration, std::uint32_t> furthest;  // end so far, by interval
        for (const Piece& piece : sorted) {
            const auto slower = furthest.upper_bound(piece.every);
            if (std::any_of(furthest.begin(), slower,
                            [&](const auto& faster) { return faster.second >= piece.end; }))
                continue;
            furthest[piece.every] = piece.end;
            kept.push_back(piece);
        }
        return kept;
    }

    /// Plans each interval by itself from the shortest, without pieces already served, then joins
    /// reads.
    std::vector<Box> plan_by_interval() const {
        std::map<Duration, std::vector<Piece>> intervals;
        for (const Piece& piece : pieces_) intervals[piece.every].push_back(piece);
        std::vector<Box> boxes;
        for (auto& [every, pieces] : intervals) {
            sort_by_start(boxes);
            std::erase_if(pieces, [&](const Piece& piece) {
                return find_box_for(boxes, piece) != boxes.end();
            });
            const std::vector<Box> added = plan_runs(pieces);
            boxes.insert(boxes.end(), added.begin(), added.end());
        }
        sort_by_start(boxes);
        return join(boxes);
    }

    /// Returns the last of the sorted boxes that serves this piece.
    std::vector<Box>::const_iterator find_box_for(const std::vector<Box>& boxes,
                                                  const Piece& piece) const {
        auto box = std::upper_bound(
            boxes.begin(), boxes.end(), piece.first,
            [](std::uint32_t first, const Box& candidate) { return first < candidate.first; });
        while (box != boxes.begin()) {
            --box;
            if (box->serves(piece)) return box;
            if (box->first + limits_.of(table_).max_items < piece.end) break;
        }
        return boxes.end();
    }

    /// Joins neighbours where that is allowed and costs no more per second.
    std::vector<Box> join(const std::vector<Box>& boxes) const {
        std::vector<Box> kept;
        for (Box last : boxes) {
            for (; !kept.empty(); kept.pop_back()) {
                const Box& low = kept.back();
                const Box both{low.first, std::max(low.end, last.end),
                               std::min(low.every, last.every)};
                if (both.end > map_.reach(low.first) || load(both) > load(low) + load(last)) break;
                last = both;
            }
            kept.push_back(last);
        }
        return kept;
    }

    /// Assigns every piece to a read; drops reads without pieces.
    std::vector<PlannedRead> serve(std::vector<Box> boxes) const {
        sort_by_start(boxes);
        std::vector<PlannedRead> reads;
        reads.reserve(boxes.size());
        for (const Box& box : boxes)
            reads.push_back({{table_, box.first, box.end - box.first}, box.every, {}});
        for (const Piece& piece : pieces_) {
            const auto index = find_box_for(boxes, piece) - boxes.cbegin();
            reads[static_cast<std::size_t>(index)].wants.push_back(piece.want);
        }
        std::erase_if(reads, [](const PlannedRead& read) { return read.wants.empty(); });
        return reads;
    }

    const PlanLimits& limits_;
    modbus::Table table_;
    TableMap map_;
    std::vector<double> seconds_;  ///< cost of a read, by number of items
    std::vector<Piece> pieces_;    ///< sorted
};

/// Returns the read of exactly these pieces.
PlannedRead read_of(const PlannedRead& whole, std::span<const Piece> pieces) {
    PlannedRead read{{whole.span.table, pieces.front().first, 0}, Duration::max(), {}};
    std::uint32_t end = 0;
    for (const Piece& piece : pieces) {
        end = std::max(end, piece.end);
        read.every = std::min(read.every, piece.every);
        read.wants.push_back(piece.want);
    }
    read.span.count = end - read.span.first;
    std::sort(read.wants.begin(), read.wants.end());
    return read;
}

/// Returns where to cut pieces sorted by start: the index of the first piece of the right half.
std::size_t cut_index(const std::vector<Piece>& pieces) {
    std::size_t best = 0;
    std::int64_t widest = -1;
    std::size_t off_centre = pieces.size();
    std::uint32_t end = pieces.front().end;
    for (std::size_t i = 1; i < pieces.size(); end = std::max(end, pieces[i++].end)) {
        const Piece& before = pieces[i - 1];
        if (before.first == pieces[i].first && before.end == pieces[i].end) continue;
        const std::int64_t hole =
            pieces[i].first > end ? std::int64_t{pieces[i].first} - end : std::int64_t{0};
        const std::size_t off = std::max(i, pieces.size() - i) - std::min(i, pieces.size() - i);
        if (hole < widest || (hole == widest && off >= off_centre)) continue;
        widest = hole;
        off_centre = off;
        best = i;
    }
    return best;
}

}  // namespace

PlanLimits make_plan_limits(const profile::PanelProfile& profile, const SerialFormat& serial,
                            Duration gap) {
    const profile::PanelProfile standard;
    PlanLimits limits;
    limits.serial = serial;
    limits.gap = gap;
    for (const modbus::Table table : modbus::kTables) {
        const modbus::Function function = modbus::read_function(table);
        if (!profile.has_function(function)) continue;
        limits.of(table).max_items =
            std::min(profile.max_count(function), standard.max_count(function));
    }
    for (const profile::Area& area : profile.areas) {
        limits.of(area.table).readable.push_back(area.readable);
        for (const modbus::Table table : area.also)
            limits.of(table).readable.push_back(area.readable);
    }
    return limits;
}

namespace {

std::size_t data_size(modbus::Table table, std::uint32_t count) {
    return modbus::is_bit_table(table) ? (std::size_t{count} + 7) / 8 : std::size_t{count} * 2;
}

/// A panel recognises the end of a request by the standard's silence, whatever gap is configured.
Duration exchange_time(const PlanLimits& limits, std::size_t request, std::size_t reply) {
    return frame_time(limits.serial, request) + silent_interval(limits.serial) + limits.think_time +
           frame_time(limits.serial, reply) + limits.gap;
}

}  // namespace

Duration read_cost(const PlanLimits& limits, modbus::Table table, std::uint32_t count) {
    const std::size_t data = data_size(table, count);
    return exchange_time(limits, modbus::kReadRequestAdu, modbus::kReadReplyOverhead + data);
}

Duration write_cost(const PlanLimits& limits, modbus::Table table, std::uint32_t count,
                    bool single) {
    const std::size_t data = data_size(table, count);
    const std::size_t request = modbus::kReadRequestAdu + (single ? 0 : 1 + data);
    return exchange_time(limits, request, modbus::kReadRequestAdu);  // its reply has two words, too
}

std::vector<PlannedRead> plan_reads(std::span<const Want> wants, const PlanLimits& limits) {
    std::vector<PlannedRead> plan;
    for (const modbus::Table table : modbus::kTables) {
        const bool wanted = std::any_of(wants.begin(), wants.end(),
                                        [&](const Want& want) { return want.span.table == table; });
        if (!wanted || limits.of(table).max_items == 0) continue;
        std::vector<PlannedRead> reads = TablePlanner(wants, limits, table).run();
        std::move(reads.begin(), reads.end(), std::back_inserter(plan));
    }
    return plan;
}

std::optional<std::pair<PlannedRead, PlannedRead>> bisect(const PlannedRead& read,
                                                          std::span<const Want> wants) {
    std::vector<Piece> pieces;
    for (const std::size_t index : read.wants) {
        const modbus::Span& want = wants[index].span;
        pieces.push_back({std::max(want.first, read.span.first),
                          std::min(want.end(), read.span.end()), wants[index].every, index});
    }
    if (pieces.empty()) return std::nullopt;
    sort_by_start(pieces);
    const std::size_t at = cut_index(pieces);
    if (at == 0) return std::nullopt;
    const std::span<const Piece> all(pieces);
    return std::pair(read_of(read, all.first(at)), read_of(read, all.subspan(at)));
}

}  // namespace panelgate::points
