#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/base/fault.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/tcp_server/settings.hpp"

namespace panelgate::tcp_server {

/// What routing needs to know about a line. The bus outlives every map that refers to it.
struct LineInfo {
    std::string name;
    bus::BusClient* bus = nullptr;       ///< null: asked of a configuration that does not run
    std::vector<std::uint8_t> stations;  ///< configured station addresses
    bool pass_unlisted = true;
    /// Of an image, whose one station is its unit: the lines of its points. A listener that serves
    /// all these lines serves the image, and names or broadcasts to none. std::nullopt: a line.
    std::optional<std::vector<std::string>> shows{};
    friend bool operator==(const LineInfo&, const LineInfo&) = default;
};

/// The station behind a unit id. Station 0 (from an alias) is a broadcast to that line.
struct Target {
    bus::BusClient* bus = nullptr;
    std::uint8_t station = 0;
};

/// Where a client's unit ids lead, for one listener or serial master: the one answer to that, for
/// requests, for those that wait while it changes, and for what a change would mean. Immutable.
/// Pure.
class UnitMap {
  public:
    /// `lines`: at least those named by the settings, in any order. Aliases may refer to any of
    /// them; the other rules apply only to the listener's own (settings.lines; empty: all given).
    /// Throws std::invalid_argument if the settings name an unknown line.
    UnitMap(const Settings& settings, const std::vector<LineInfo>& lines);

    /// Returns the target of an alias, of an image, or of a station listed by exactly one line of
    /// the listener; on a listener with a single line that passes unlisted stations, also of the
    /// rest of 1..247. Everything else, including unit 0 without an alias and 248..255 unless
    /// listed, is Fault::not_routed.
    Result<Target> route(std::uint8_t unit) const;
    /// As route(), by the line's name.
    std::optional<UnitTarget> place(std::uint8_t unit) const;
    /// Returns the lines a request to this unit is broadcast to: all of the listener's for unit 0
    /// without an alias, one for an alias to station 0, none for any other unit.
    std::vector<bus::BusClient*> broadcast_lines(std::uint8_t unit) const;
    /// As broadcast_lines(), by the lines' names.
    std::vector<std::string> broadcast_names(std::uint8_t unit) const;
    /// True for an alias or a configured station.
    bool is_listed(std::uint8_t unit) const { return is_alias(unit) || listed_[unit]; }
    /// True for an alias: a unit that the settings name.
    bool is_alias(std::uint8_t unit) const { return aliases_.contains(unit); }
    /// Returns the listener's own lines, in the order of the settings.
    std::vector<bus::BusClient*> lines() const { return buses_of(own_); }

  private:
    /// A station of a line in `lines_`.
    struct Place {
        std::size_t line = 0;
        std::uint8_t station = 0;
    };
    struct RoutedLine {
        std::string name;
        bus::BusClient* bus = nullptr;
    };

    std::size_t index_of(const std::string& line) const;
    void add_stations(std::size_t line, const std::vector<std::uint8_t>& stations);
    std::optional<Place> find(std::uint8_t unit) const;
    std::vector<std::size_t> broadcast(std::uint8_t unit) const;
    std::vector<bus::BusClient*> buses_of(const std::vector<std::size_t>& lines) const;

    std::vector<RoutedLine> lines_;
    std::map<std::uint8_t, Place> aliases_;
    std::array<std::optional<Place>, 256> direct_{};
    std::array<bool, 256> listed_{};
    std::vector<std::size_t> own_;  ///< in `lines_`
};

}  // namespace panelgate::tcp_server
