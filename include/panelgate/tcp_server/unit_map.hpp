#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "panelgate/base/fault.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/tcp_server/settings.hpp"

namespace panelgate::tcp_server {

/// What a listener has to know of a line. The bus outlives every map that names it.
struct LineInfo {
    std::string name;
    bus::BusClient* bus = nullptr;
    std::vector<std::uint8_t> stations;  ///< ids that the configuration lists
    bool pass_unlisted = true;
    friend bool operator==(const LineInfo&, const LineInfo&) = default;
};

/// The station behind a unit id. Station 0 (of an alias) is everybody on that line.
struct Target {
    bus::BusClient* bus = nullptr;
    std::uint8_t station = 0;
};

/// A client's unit id -> line and station, for one listener. Built once, never changes. Pure.
class UnitMap {
  public:
    /// `lines`: at least those that the settings name, in any order. Aliases may point at any of
    /// them; the other rules look only at the listener's own (settings.lines; empty: all given).
    /// Throws std::invalid_argument when the settings name a line that is not there.
    UnitMap(const Settings& settings, const std::vector<LineInfo>& lines);

    /// An alias; a station that exactly one line of the listener lists; on a listener with one line
    /// that passes unlisted stations also the rest of 1..247. Everything else, unit 0 without an
    /// alias and 248..255 included, is Fault::not_routed.
    Result<Target> route(std::uint8_t unit) const;
    /// Where a request to this unit is broadcast: all lines of the listener for unit 0 without an
    /// alias, the one line of an alias to station 0; nowhere for any other unit.
    std::vector<bus::BusClient*> broadcast_lines(std::uint8_t unit) const;
    /// An alias, or a station that the configuration lists.
    bool is_listed(std::uint8_t unit) const { return is_alias(unit) || listed_[unit]; }
    bool is_alias(std::uint8_t unit) const { return aliases_.contains(unit); }
    /// The listener's own lines, in the order of the settings.
    const std::vector<bus::BusClient*>& lines() const { return lines_; }

  private:
    void add_stations(const LineInfo& line);

    std::map<std::uint8_t, Target> aliases_;
    std::array<Target, 256> direct_{};  ///< bus is null where nothing is routed
    std::array<bool, 256> listed_{};
    std::vector<bus::BusClient*> lines_;
};

}  // namespace panelgate::tcp_server
