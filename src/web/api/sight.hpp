#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/access/line_rules.hpp"
#include "panelgate/base/who.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/web/api/directory.hpp"
#include "panelgate/web/http/event_hub.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

/// What a client may see of the plant: what the rules of `access` let it read. What is asked of a
/// panel is judged by its bus; this is for what the gateway knows itself. The directory must
/// outlive it.
class Sight {
  public:
    Sight(const Directory& directory, WhoRef who) : directory_(directory), who_(std::move(who)) {}

    const WhoRef& who() const { return who_; }
    /// True if nothing of the plant is hidden.
    bool everything() const;
    /// True if some station of the line may be read, or it has none.
    bool line(const LineEntry& line) const;
    /// True if every item of every station may be read: what tells of all stations of the line may
    /// be shown, as its trace, incidents, history and clients.
    bool whole(const LineEntry& line) const;
    /// True if some item may be read.
    bool station(const LineEntry& line, std::uint8_t id) const;
    bool station(const StationEntry& station) const;
    /// True if every item may be read: bytes of any of its frames may be shown.
    bool whole(const LineEntry& line, std::uint8_t id) const;
    bool point(const StationEntry& station, const points::Point& point) const;
    /// True if the point, or without one some item of the station, may be read or written.
    bool concerns(const StationEntry& station, std::string_view point) const;
    /// By the names of an event.
    bool event(const EventTopic& topic) const;
    /// By the names of a metric's labels; an empty one is absent.
    bool named(std::string_view line, std::string_view station, std::string_view point) const;

  private:
    bool reads() const;
    const StationEntry* find(std::string_view line, std::string_view station) const;

    const Directory& directory_;
    WhoRef who_;
};

/// Returns why the path of this request names something that its client may not see: 403 with the
/// rule. Requests that go to a bus are judged there, and counted.
std::optional<Problem> check_sight(const HttpRequest& request, const Directory& directory);

/// What is wrong with a request is not told to who may neither read nor write what it names: 403 in
/// its place. `point`: by name; empty: none. Nothing if it may be told.
std::optional<Problem> instead_of_telling(std::string_view station, std::string_view point,
                                          const WhoRef& who, const Directory& directory);
/// The same for the answer to a request whose path this was, which has not reached a bus.
std::optional<Problem> instead_of_telling(const std::vector<std::string>& path, const WhoRef& who,
                                          const Directory& directory);

/// Returns the text of /metrics without the series of what may not be seen.
std::string seen_metrics(std::string_view text, const Sight& sight);

}  // namespace panelgate::web
