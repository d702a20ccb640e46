#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/json/object.hpp>
#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "body.hpp"
#include "panelgate/web/api/directory.hpp"
#include "panelgate/web/http/problem.hpp"
#include "station_path.hpp"

namespace panelgate::web {

/// The entries of {"items": [...]}: objects, at least one, no more than `most`.
Parsed<std::vector<boost::json::object>> entries_of(std::string_view body, std::size_t most);

/// An entry names a point or items: {"point": "press/temperature"}. It may have an "id" of any
/// form, for who asks: its result repeats the entry.
bool names_point(const boost::json::object& entry);
/// 400 for a member that no entry of its kind has: the names of what it wants, and these.
Parsed<void> check_members(const boost::json::object& entry, Members of_points, Members of_items);
Parsed<PointOfStation> point_of(const boost::json::object& entry, const Directory& directory);
/// {"station", "device"} or {"station", "table", "address"}: one item there.
Parsed<Items> item_of(const boost::json::object& entry, const Directory& directory);

/// "items[2]: …": what is malformed fails the whole list, and nothing of it is done.
Problem in_entry(std::size_t index, Problem problem);

/// Which of them are on which line, in their order. `line_of` gives a line's name; null: none.
template <class Entry, class LineOf>
std::map<std::string, std::vector<Entry*>> by_line(std::vector<Entry>& entries, LineOf line_of) {
    std::map<std::string, std::vector<Entry*>> lines;
    for (Entry& entry : entries) {
        const std::string* line = line_of(entry);
        if (line != nullptr) lines[*line].push_back(&entry);
    }
    return lines;
}

/// Runs all of them at once, in the loop of who awaits; goes on when the last has ended. Then the
/// first exception of any is thrown.
boost::asio::awaitable<void> gather(std::vector<boost::asio::awaitable<void>> all);

}  // namespace panelgate::web
