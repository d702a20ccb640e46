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

/// What a client may see of what the gateway itself knows of the plant, by the rules of `access`.
/// Requests to a panel are judged by its bus. The directory must outlive the object.
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

/// What the answers of a route show of the line, station or point that its path names. Answers for
/// which a bus is asked show nothing more: that bus judges the request, and counts it.
enum class Shown : std::uint8_t { nothing, line, whole_line, station, point };
/// Returns why the client of this request may not see what its path names: 403 with the rule. A
/// role of the configuration that has this right may see what it reads by the rules, too.
std::optional<Problem> check_sight(const HttpRequest& request, const Directory& directory,
                                   Shown shown, Right right);

/// Returns 403 for a client that may neither read nor write this station, or this point of the
/// station: such a client is not told what is wrong with its request. `point`: by name; empty:
/// none.
std::optional<Problem> instead_of_telling(std::string_view station, std::string_view point,
                                          const WhoRef& who, const Directory& directory);
/// The same for a request with this path that has not reached a bus.
std::optional<Problem> instead_of_telling(const std::vector<std::string>& path, const WhoRef& who,
                                          const Directory& directory);

/// Returns the text of /metrics without the series of what may not be seen.
std::string seen_metrics(std::string_view text, const Sight& sight);

}  // namespace panelgate::web
