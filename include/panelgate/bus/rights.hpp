#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::bus {

/// What forbids a request: the access of stations, or a guard by what the panel's profile says.
enum class Rule : std::uint8_t {
    read_only,                 ///< a write to a station that may only be read
    broadcast_over_read_only,  ///< it would write to such a station, too
    function,                  ///< the panel does not have it
    quantity,                  ///< more items than it takes, or a request that contradicts itself
    range,                     ///< not all of it is memory of the panel
    listening,                 ///< its line is only listened to, whatever is asked
    write_protected,           ///< memory that it does not let be written
};
/// "access", "function", "quantity", "range", "listen" or "read-only": stable words.
std::string_view label(Rule rule);
inline bool is_access(Rule rule) {
    return rule == Rule::read_only || rule == Rule::broadcast_over_read_only;
}

/// What a guard says against a request.
struct Objection {
    Rule rule = Rule::function;
    std::string why{};  ///< a clause for the user: "generic has no function 23"
};
/// Of what is to be refused instead of being transmitted.
using Guard = std::function<std::optional<Objection>(const modbus::Request&)>;

/// The request that goes out instead of the one that was asked; nothing: that one itself. It must
/// do the same, of no more items, and modbus::translated_back() must know what its reply means.
using Translate = std::function<std::optional<modbus::Request>(const modbus::Request&)>;

enum class Access : std::uint8_t { read_write, read_only };

/// What the configuration says of a station to its bus.
struct StationSettings {
    std::string name;
    Access access = Access::read_write;
    Guard guard{};          ///< empty: whatever is asked goes out
    Translate translate{};  ///< empty: whatever is asked goes out as it came
    /// What its panel is likely to be asked: counted from the start, with 0.
    std::vector<std::uint8_t> functions{};
    /// The same of what `translate` does: by function asked and function sent.
    std::vector<std::pair<std::uint8_t, std::uint8_t>> translations{};
};

/// Those that the configuration lists, by their ids.
using Stations = std::map<std::uint8_t, StationSettings>;

/// What goes out instead of this request; nothing: itself. A broadcast stays as it came, because
/// it is for many.
std::optional<modbus::Request> translated(const Stations& stations, std::uint8_t id,
                                          const modbus::Request& request);

/// Its name, or its id when it is not listed.
std::string name_of(const Stations& stations, std::uint8_t id);

/// Why nobody is asked: what may be done to a station does not include this request.
struct Refusal {
    Rule rule = Rule::read_only;
    std::string station;  ///< the name of the one that the rule protects
    modbus::ExceptionCode code = modbus::ExceptionCode::illegal_function;  ///< for Modbus clients
    std::string why{};  ///< a guard's own words; the name of a line that is only listened to

    friend bool operator==(const Refusal&, const Refusal&) = default;
};

/// What is answered to the function that is refused: Fault::denied, but of a guard the exception
/// that its panel would have answered.
Result<Bytes> answer_to(const Refusal& refusal, std::uint8_t function);

/// The one place that says who may do what on a line. Pure.
class Rights {
  public:
    Rights() = default;
    explicit Rights(Stations stations) : stations_(std::move(stations)) {}

    /// Station 0 is a broadcast.
    std::optional<Refusal> judge(std::uint8_t station, const modbus::Request& request) const;
    /// What judge() says to every write to this station, whatever it writes.
    std::optional<Refusal> judge_write(std::uint8_t station) const;

  private:
    std::optional<Refusal> judge_broadcast() const;

    Stations stations_;
};

}  // namespace panelgate::bus
