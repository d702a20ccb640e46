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

/// Items to be read together (all registers of a 32-bit value) at this interval.
struct Want {
    modbus::Span span;    ///< at least one item, within the table
    Duration every = 1s;  ///< greater than 0
    friend bool operator==(const Want&, const Want&) = default;
};

/// A panel's read limits for one table.
struct TableLimits {
    std::uint32_t max_items = 0;                  ///< items per read; 0: the table cannot be read
    std::vector<profile::AddressRange> readable;  ///< a read may include unwanted items here
    friend bool operator==(const TableLimits&, const TableLimits&) = default;
};

/// Limits and costs of one station's reads.
struct PlanLimits {
    SerialFormat serial;
    Duration gap = 1750us;      ///< silence after the reply
    Duration think_time = 1ms;  ///< the panel's, after the silence that ends the request
    std::array<TableLimits, modbus::kTables.size()> tables;  ///< by modbus::Table

    TableLimits& of(modbus::Table table) { return tables[static_cast<std::size_t>(table)]; }
    const TableLimits& of(modbus::Table table) const {
        return tables[static_cast<std::size_t>(table)];
    }
    friend bool operator==(const PlanLimits&, const PlanLimits&) = default;
};

/// Returns the profile's limits and readable areas, within the standard's limits (AP 6.1 to 6.4:
/// 2000 bits, 125 registers). A table is unreadable if the profile does not list its function; a
/// profile without functions has the standard's.
PlanLimits make_plan_limits(const profile::PanelProfile& profile, const SerialFormat& serial,
                            Duration gap);

/// One request of the plan.
struct PlannedRead {
    modbus::Span span;
    Duration every{};                ///< shortest interval of its wants
    std::vector<std::size_t> wants;  ///< indices of the wants it serves, ascending
};

/// Returns how long a read of `count` items occupies the line: request, the silence that ends it,
/// think time, reply, gap.
Duration read_cost(const PlanLimits& limits, modbus::Table table, std::uint32_t count);
/// The same for a write by 15 or 16; `single`: by 05 or 06.
Duration write_cost(const PlanLimits& limits, modbus::Table table, std::uint32_t count,
                    bool single);

/// Returns few reads that serve every want, sorted by table and address. If all intervals are
/// equal, the wire time is minimal. Otherwise it is the better of two plans (one interval after
/// another, then joined if that costs no more per second; or all at once), which is rarely above
/// the minimum. A want lies whole in one read; a want larger than the maximum read is cut into
/// several. Every item of a read is in a want or readable by the profile. A want may be served by a
/// read with a shorter interval that contains it. Invalid wants, and wants in unreadable tables,
/// are not planned. Complexity: O(n log n + n * max_items), a few milliseconds for thousands of
/// points.
std::vector<PlannedRead> plan_reads(std::span<const Want> wants, const PlanLimits& limits);

/// Splits a read after exception 02 or 03 into two that share its wants, cut at the widest hole, or
/// in the middle if there is none. nullopt if all its wants are the same items: the panel refuses
/// this span itself. `wants`: those that the plan was made from.
std::optional<std::pair<PlannedRead, PlannedRead>> bisect(const PlannedRead& read,
                                                          std::span<const Want> wants);

}  // namespace panelgate::points
