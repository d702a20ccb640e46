#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/profile/panel_profile.hpp"

namespace panelgate::points {

/// Items that somebody wants together (all registers of a 32-bit value) this often.
struct Want {
    modbus::Span span;    ///< at least one item, none beyond the end of the table
    Duration every = 1s;  ///< above 0
    friend bool operator==(const Want&, const Want&) = default;
};

/// What the panel can do with one table.
struct TableLimits {
    std::uint32_t max_items = 0;                  ///< of one read; 0 = this table cannot be read
    std::vector<profile::AddressRange> readable;  ///< what a read may cross without being asked to
    friend bool operator==(const TableLimits&, const TableLimits&) = default;
};

/// What bounds the reads of one station, and what they cost.
struct PlanLimits {
    SerialFormat serial;
    Duration gap = 1750us;      ///< silence after the reply
    Duration think_time = 1ms;  ///< of the panel, after the silence that ends the request
    std::array<TableLimits, modbus::kTables.size()> tables;  ///< by modbus::Table
    /// Learned from exceptions 02 and 03: no read may contain one of these whole. The caller bounds
    /// how many there are.
    std::vector<modbus::Span> refused;

    TableLimits& of(modbus::Table table) { return tables[static_cast<std::size_t>(table)]; }
    const TableLimits& of(modbus::Table table) const {
        return tables[static_cast<std::size_t>(table)];
    }
    friend bool operator==(const PlanLimits&, const PlanLimits&) = default;
};

/// The profile's limits within the standard's (AP 6.1 to 6.4: 2000 bits, 125 registers) and its
/// readable areas. A function that the profile does not list makes a table unreadable; a profile
/// without functions has the standard's.
PlanLimits make_plan_limits(const profile::PanelProfile& profile, const SerialFormat& serial,
                            Duration gap);

/// One request of the plan.
struct PlannedRead {
    modbus::Span span;
    Duration every{};                ///< the shortest interval of its wants
    std::vector<std::size_t> wants;  ///< indices of what it serves, ascending
    /// It contains a refused span, because what is wanted does: expect an exception.
    bool refused = false;
};

/// How long a read of `count` items keeps the line from everybody else: request, the silence that
/// ends it, think time, reply, gap.
Duration read_cost(const PlanLimits& limits, modbus::Table table, std::uint32_t count);
/// The same of a write by 15 or 16; `single`: by 05 or 06.
Duration write_cost(const PlanLimits& limits, modbus::Table table, std::uint32_t count,
                    bool single);

/// Few reads that serve every want, sorted by table and address. Where all intervals are the same
/// this is the least wire time that is possible; where they differ it is the better of two plans
/// (interval after interval, then joined where that is not dearer per second; or all at once),
/// which is seldom more than the least. A want lies in one read, whole; one that is larger than a
/// read may be is cut, and several reads name it. Every item of a read is in a want or readable by
/// the profile. A read contains a refused span only if it is exactly one want (or a piece of a cut
/// one), with `refused` set: nothing else is read with it. A want may be served by a read of a
/// shorter interval that contains it. Wants that break their contract, or whose table cannot be
/// read, are not planned. Work: O(n log n + n * max_items), some milliseconds for thousands of
/// points.
std::vector<PlannedRead> plan_reads(std::span<const Want> wants, const PlanLimits& limits);

/// After exception 02 or 03: two reads that share the wants of this one, cut at its widest hole, or
/// in the middle when there is none. Nothing when all its wants are the same items: then this span
/// itself is what the panel refuses. `wants` are those that the plan was made of.
std::optional<std::pair<PlannedRead, PlannedRead>> bisect(const PlannedRead& read,
                                                          std::span<const Want> wants);

/// When both halves of a bisected read succeed, what the panel refuses lies between them: the
/// smallest span that no read may contain then. Nothing when the halves overlap: then only the read
/// that was bisected is known to be refused.
std::optional<modbus::Span> seam(const PlannedRead& left, const PlannedRead& right);

/// Keeps the contract of Want.
bool is_plannable(const Want& want);

/// How far a read of one table may go, from what is readable, what is wanted and what was refused.
class TableMap {
  public:
    TableMap(std::span<const Want> wants, const PlanLimits& limits, modbus::Table table);

    /// The furthest end (one past the last item) that a read from `first` may have. `first` itself
    /// must be wanted or readable. Less than a want's end when the want contains a refused span.
    std::uint32_t reach(std::uint32_t first) const;

  private:
    struct Piece {
        std::uint32_t first = 0;
        std::uint32_t end = 0;
    };
    std::uint32_t max_items_;
    std::vector<Piece> open_;     ///< disjoint, ascending, never adjacent
    std::vector<Piece> refused_;  ///< ascending; `end` is the least of it and all that follow
};

}  // namespace panelgate::points
