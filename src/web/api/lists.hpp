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

/// The entries of {"items": [...]}: at least one object, at most `most`.
Parsed<std::vector<boost::json::object>> entries_of(std::string_view body, std::size_t most);

/// True if the entry names a point ({"point": "press/temperature"}) rather than items. Its "id", of
/// any type, is the client's own: the result repeats the entry.
bool names_point(const boost::json::object& entry);
/// 400 for a member that an entry of its kind does not have: the addressing members, and the given
/// ones.
Parsed<void> check_members(const boost::json::object& entry, Members of_points, Members of_items);
Parsed<PointOfStation> point_of(const boost::json::object& entry, const Directory& directory);
/// The one item that {"station", "device"} or {"station", "table", "address"} names.
Parsed<Items> item_of(const boost::json::object& entry, const Directory& directory);

/// What is wrong with an entry, or in its place that it is denied: as instead_of_telling().
Problem told_of(const boost::json::object& entry, Problem why, const WhoRef& who,
                const Directory& directory);
/// Prefixes the problem with "items[2]: ". A malformed entry fails the whole list, and nothing of
/// it is done.
Problem in_entry(std::size_t index, Problem problem);

/// Groups entries by line, in their order. `line_of` returns a line's name; null: skip the entry.
template <class Entry, class LineOf>
std::map<std::string, std::vector<Entry*>> by_line(std::vector<Entry>& entries, LineOf line_of) {
    std::map<std::string, std::vector<Entry*>> lines;
    for (Entry& entry : entries) {
        const std::string* line = line_of(entry);
        if (line != nullptr) lines[*line].push_back(&entry);
    }
    return lines;
}

/// Runs all of them concurrently on the awaiting coroutine's executor and resumes when the last has
/// ended. Then rethrows the first exception.
boost::asio::awaitable<void> gather(std::vector<boost::asio::awaitable<void>> all);

}  // namespace panelgate::web
