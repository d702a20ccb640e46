#pragma once

#include <boost/json/object.hpp>
#include <boost/json/value.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace panelgate::commands {

// The gateway's answers (docs/reference/rest.md) as a person reads them.

/// A member's text, "" if it is not there or none.
std::string text_of(const boost::json::object& object, std::string_view name);
std::optional<double> number_of(const boost::json::object& object, std::string_view name);
/// The objects of a member that is a list.
std::vector<const boost::json::object*> objects_of(const boost::json::object& object,
                                                   std::string_view name);

/// "21.5", "true", "manual", "10 20 30"; "-" for null.
std::string value_text(const boost::json::value& value);

/// What was read of a table or a notation: a line for each value, its place before it. `type`: of
/// the values (f32), or "".
std::string reading_text(const boost::json::object& answer, std::string_view type);
/// "204.6 celsius", "1 (manual)", "40 celsius, stale", "no value"; without its age.
std::string point_text(const boost::json::object& point);
bool is_good(const boost::json::object& point);
/// "oven/temperature  204.6 celsius, read 0.4 s ago"
std::string point_line(const std::string& shown, const boost::json::object& point);

/// "oven/mode = 1 (manual), confirmed"; `typed`: where the answer has no value.
std::string written_text(const std::string& shown, const std::string& typed,
                         const boost::json::object& answer);
bool is_confirmed(const boost::json::object& answer);
/// "the station did not answer in time; it was transmitted, so it may be in effect"
std::string not_written_text(const boost::json::object& problem);

/// An event of the events stream.
struct Event {
    std::string type;
    std::string data;
};
/// Cuts a stream of server-sent events (HTML, 9.2.6), which may come in any pieces.
class EventCutter {
  public:
    std::vector<Event> take(std::string_view more);

  private:
    void line(std::string_view text, std::vector<Event>& events);

    std::string rest_;
    Event event_;
};

}  // namespace panelgate::commands
