#include "panelgate/points/read_plan.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <tuple>

#include "table_map.hpp"

namespace panelgate::points {
namespace {

constexpr std::array kTables = {modbus::Table::coils, modbus::Table::discrete_inputs,
                                modbus::Table::input_registers, modbus::Table::holding_registers};

/// Part of a want, or all of it.
struct Piece {
    std::uint32_t first = 0;
    std::uint32_t end = 0;
    std::size_t want = 0;
};

void cut(const Want& want, std::size_t index, std::uint32_t max_items, std::vector<Piece>& out) {
    const std::uint32_t end = want.address + want.count;
    for (std::uint32_t first = want.address; first < end; first += max_items)
        out.push_back({first, std::min(end, first + max_items), index});
}

void sort_by_start(std::vector<Piece>& pieces) {
    std::sort(pieces.begin(), pieces.end(), [](const Piece& a, const Piece& b) {
        return std::tie(a.first, b.end, a.want) < std::tie(b.first, a.end, b.want);
    });
}

/// Plans one table, interval after interval from the shortest.
class TablePlanner {
  public:
    TablePlanner(std::span<const Want> wants, const PlanLimits& limits, modbus::Table table)
        : limits_(limits), table_(table), map_(wants, limits, table) {
        for (std::size_t i = 0; i < wants.size(); ++i) {
            if (wants[i].table != table || !is_plannable(wants[i])) continue;
            cut(wants[i], i, limits.of(table).max_items, by_interval_[wants[i].every]);
        }
    }

    std::vector<PlannedRead> run() {
        for (auto& [every, pieces] : by_interval_) plan_interval(every, std::move(pieces));
        join_intervals();
        for (PlannedRead& read : refused_) reads_.push_back(std::move(read));
        for (PlannedRead& read : reads_) {
            std::sort(read.wants.begin(), read.wants.end());
            read.wants.erase(std::unique(read.wants.begin(), read.wants.end()), read.wants.end());
        }
        sort_by_address(reads_);
        return std::move(reads_);
    }

  private:
    static void sort_by_address(std::vector<PlannedRead>& reads) {
        std::sort(reads.begin(), reads.end(), [](const PlannedRead& a, const PlannedRead& b) {
            return std::tie(a.address, b.count, a.every) < std::tie(b.address, a.count, b.every);
        });
    }

    void plan_interval(Duration every, std::vector<Piece> pieces) {
        std::erase_if(pieces, [&](const Piece& piece) { return plan_refused(every, piece); });
        sort_by_start(pieces);
        serve_by_faster(pieces);
        // Without those that lie in another, starts and ends both ascend. Then the best partition
        // is one into runs: what a read of a run may contain, each of its parts may.
        std::vector<Piece> outer;
        for (const Piece& piece : pieces)
            if (outer.empty() || piece.end > outer.back().end) outer.push_back(piece);
        const std::size_t planned = reads_.size();
        plan_runs(every, outer);
        std::size_t at = planned;
        for (const Piece& piece : pieces) {
            while (piece.end > reads_[at].address + reads_[at].count) ++at;
            reads_[at].wants.push_back(piece.want);
        }
    }

    /// A piece with a refused span in it is asked for alone; pieces of the same items share it.
    bool plan_refused(Duration every, const Piece& piece) {
        if (piece.end <= map_.reach(piece.first)) return false;
        const std::uint32_t count = piece.end - piece.first;
        const auto same =
            std::find_if(refused_.begin(), refused_.end(), [&](const PlannedRead& read) {
                return read.address == piece.first && read.count == count;
            });
        if (same != refused_.end())
            same->wants.push_back(piece.want);
        else
            refused_.push_back({table_, piece.first, count, every, {piece.want}, true});
        return true;
    }

    /// Takes out the pieces that the reads of shorter intervals contain.
    void serve_by_faster(std::vector<Piece>& pieces) {
        sort_by_address(reads_);
        std::size_t next = 0;
        std::size_t widest = reads_.size();  // of those that start at or before the piece
        std::erase_if(pieces, [&](const Piece& piece) {
            for (; next < reads_.size() && reads_[next].address <= piece.first; ++next)
                if (widest == reads_.size() ||
                    reads_[next].span().end() > reads_[widest].span().end())
                    widest = next;
            if (widest == reads_.size() || piece.end > reads_[widest].span().end()) return false;
            reads_[widest].wants.push_back(piece.want);
            return true;
        });
    }

    /// Shortest path over the pieces: best[i] is the least cost of all pieces from i.
    void plan_runs(Duration every, const std::vector<Piece>& pieces) {
        std::vector<Duration> best(pieces.size() + 1, Duration::max());
        std::vector<std::size_t> next(pieces.size());
        best[pieces.size()] = Duration::zero();
        for (std::size_t i = pieces.size(); i-- > 0;) {
            const std::uint32_t reach = map_.reach(pieces[i].first);
            for (std::size_t j = i; j < pieces.size() && pieces[j].end <= reach; ++j) {
                const Duration cost =
                    read_cost(limits_, table_, pieces[j].end - pieces[i].first) + best[j + 1];
                if (cost > best[i]) continue;
                best[i] = cost;
                next[i] = j + 1;
            }
        }
        for (std::size_t i = 0; i < pieces.size(); i = next[i]) {
            const std::uint32_t first = pieces[i].first;
            reads_.push_back({table_, first, pieces[next[i] - 1].end - first, every, {}, false});
        }
    }

    double load(const PlannedRead& read) const {
        return to_seconds(read_cost(limits_, table_, read.count)) / to_seconds(read.every);
    }

    /// Both as one read, when that is allowed and not dearer per second.
    std::optional<PlannedRead> joined(const PlannedRead& low, const PlannedRead& high) const {
        const std::uint32_t end = std::max(low.span().end(), high.span().end());
        if (end > map_.reach(low.address)) return std::nullopt;
        PlannedRead both{table_,    low.address, end - low.address, std::min(low.every, high.every),
                         low.wants, false};
        if (load(both) > load(low) + load(high)) return std::nullopt;
        both.wants.insert(both.wants.end(), high.wants.begin(), high.wants.end());
        return both;
    }

    void join_intervals() {
        if (by_interval_.size() < 2) return;
        sort_by_address(reads_);
        std::vector<PlannedRead> kept;
        for (PlannedRead& read : reads_) {
            PlannedRead last = std::move(read);
            while (!kept.empty()) {
                std::optional<PlannedRead> both = joined(kept.back(), last);
                if (!both) break;
                last = std::move(*both);
                kept.pop_back();
            }
            kept.push_back(std::move(last));
        }
        reads_ = std::move(kept);
    }

    const PlanLimits& limits_;
    modbus::Table table_;
    TableMap map_;
    std::map<Duration, std::vector<Piece>> by_interval_;
    std::vector<PlannedRead> reads_;
    std::vector<PlannedRead> refused_;
};

/// The read of exactly these pieces.
PlannedRead read_of(const PlannedRead& whole, std::span<const Piece> pieces,
                    std::span<const Want> wants) {
    PlannedRead read{whole.table, pieces.front().first, 0, Duration::max(), {}, false};
    std::uint32_t end = 0;
    for (const Piece& piece : pieces) {
        end = std::max(end, piece.end);
        read.every = std::min(read.every, wants[piece.want].every);
        read.wants.push_back(piece.want);
    }
    read.count = end - read.address;
    std::sort(read.wants.begin(), read.wants.end());
    return read;
}

/// Where to cut pieces that are sorted by start: index of the first of the right half.
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
    for (const modbus::Table table : kTables) {
        const modbus::Function function = modbus::read_function(table);
        if (!profile.functions.empty() && profile.find_function(function) == nullptr) continue;
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

Duration read_cost(const PlanLimits& limits, modbus::Table table, std::uint32_t count) {
    constexpr std::size_t kRequest = 8;   // address, function, address, count, CRC
    constexpr std::size_t kOverhead = 5;  // address, function, byte count, CRC
    const std::size_t data =
        modbus::is_bit_table(table) ? (std::size_t{count} + 7) / 8 : std::size_t{count} * 2;
    return wire_time(limits.serial, kRequest) + limits.gap + limits.think_time +
           wire_time(limits.serial, kOverhead + data) + limits.gap;
}

std::vector<PlannedRead> plan_reads(std::span<const Want> wants, const PlanLimits& limits) {
    std::vector<PlannedRead> plan;
    for (const modbus::Table table : kTables) {
        if (limits.of(table).max_items == 0) continue;
        std::vector<PlannedRead> reads = TablePlanner(wants, limits, table).run();
        std::move(reads.begin(), reads.end(), std::back_inserter(plan));
    }
    return plan;
}

std::optional<std::pair<PlannedRead, PlannedRead>> bisect(const PlannedRead& read,
                                                          std::span<const Want> wants) {
    std::vector<Piece> pieces;
    for (const std::size_t index : read.wants) {
        const Span want = wants[index].span();
        pieces.push_back(
            {std::max(want.address, read.address), std::min(want.end(), read.span().end()), index});
    }
    if (pieces.empty()) return std::nullopt;
    sort_by_start(pieces);
    const std::size_t at = cut_index(pieces);
    if (at == 0) return std::nullopt;
    const std::span<const Piece> all(pieces);
    return std::pair(read_of(read, all.first(at), wants), read_of(read, all.subspan(at), wants));
}

std::optional<Span> seam(const PlannedRead& left, const PlannedRead& right) {
    if (left.table != right.table || right.address < left.span().end()) return std::nullopt;
    const std::uint32_t first = left.span().end() - 1;
    return Span{left.table, first, right.address + 1 - first};
}

}  // namespace panelgate::points
