#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/access/line_rules.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/base/role.hpp"
#include "panelgate/base/who.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::bus {

/// Why a request is forbidden: by a station's access, or by a guard from the panel's profile.
enum class Rule : std::uint8_t {
    read_only,                 ///< a write to a read-only station
    broadcast_over_read_only,  ///< a broadcast would write to a read-only station
    function,                  ///< the panel does not support it
    quantity,         ///< more items than the panel accepts, or a request that contradicts itself
    range,            ///< some items are outside the panel's memory
    listening,        ///< the line is in listen mode
    standby,          ///< another box drives the line
    write_protected,  ///< the items are read-only in the panel
    unrecorded,       ///< no write is sent while it cannot be recorded (audit.on_failure)
    denied,           ///< a rule of `access`, its default, or a role's lack
};
/// Returns "access", "function", "quantity", "range", "listen", "standby", "read-only", "audit" or
/// "denied": stable identifiers.
std::string_view label(Rule rule);
inline bool is_access(Rule rule) {
    return rule == Rule::read_only || rule == Rule::broadcast_over_read_only ||
           rule == Rule::denied;
}

/// A guard's reason to refuse a request.
struct Objection {
    Rule rule = Rule::function;
    std::string why{};  ///< a clause for the user: "generic has no function 23"
};
/// Returns an objection if the request must be refused.
using Guard = std::function<std::optional<Objection>(const modbus::Request&)>;

/// Returns the request to send instead, or nullopt to send the original. The replacement must have
/// the same effect with no more items, and modbus::translated_back() must understand its reply.
using Translate = std::function<std::optional<modbus::Request>(const modbus::Request&)>;

enum class Access : std::uint8_t { read_write, read_only };

/// A station's settings for its bus.
struct StationSettings {
    std::string name;
    Access access = Access::read_write;
    Guard guard{};          ///< empty: nothing is refused
    Translate translate{};  ///< empty: requests are sent unchanged
    /// Replies to reads of the station's tables may have any length (modbus::ByteCount::any), for
    /// clients that take a reply's bytes as they are.
    bool any_length = false;
    /// Functions that the panel is likely to be asked: their counters start at 0.
    std::vector<std::uint8_t> functions{};
    /// The same for `translate`: function requested and function sent.
    std::vector<std::pair<std::uint8_t, std::uint8_t>> translations{};
};

/// Listed stations by id.
using Stations = std::map<std::uint8_t, StationSettings>;

/// Returns the request to send instead, or nullopt to send the original. Broadcasts are never
/// translated: they go to many stations.
std::optional<modbus::Request> translated(const Stations& stations, std::uint8_t id,
                                          const modbus::Request& request);

/// True if the station is listed with `any_length`.
bool has_any_length(const Stations& stations, std::uint8_t id);

/// Returns the station's name, or its id if it is not listed.
std::string name_of(const Stations& stations, std::uint8_t id);

/// Why a request is refused without being sent.
struct Refusal {
    Rule rule = Rule::read_only;
    std::string station;  ///< the station that the rule protects
    modbus::ExceptionCode code = modbus::ExceptionCode::illegal_function;  ///< for Modbus clients
    /// The guard's reason; the line's name in listen mode; the name of the rule that denies, or of
    /// the role that lacks a right.
    std::string why{};
    std::string_view lacking{};  ///< the right that a role lacks; empty: something else refuses
    std::string_view
        door{};  ///< why the door lets the client in no more, a clause; empty: the door does

    friend bool operator==(const Refusal&, const Refusal&) = default;
};

/// Refuses what rules deny, or what the client's role may not.
Refusal denial(const access::Verdict& verdict, std::string station);

/// What somebody who has come in may do now, where that is less than all that was asked of his door
/// when he came: doors change while requests wait.
struct Admission {
    WhoRef who{};             ///< with the role that he would have now
    panelgate::Rights may{};  ///< of what reaches a line
    std::string_view rule{};  ///< what keeps him out: "token", "allow", "access"; empty: his role
    std::string_view why{};   ///< a clause for the user
};
/// What a client may do at a station (0: at all stations). nullopt: as much as when the client came
/// in.
using Admit = std::function<std::optional<Admission>(const WhoRef&, std::uint8_t station)>;

/// Returns why the door would not let this request in any more, if so.
std::optional<Refusal> refusal_at_door(const Admission& now, access::Acts acts,
                                       std::string station);

/// Refuses a write that could not be recorded: a client should try again later.
Refusal unrecorded(std::string station);

/// Returns the answer to a refused request: Fault::denied, or for a guard the exception that the
/// panel would have returned.
Result<Bytes> answer_to(const Refusal& refusal, std::uint8_t function);

/// Decides which requests a line's stations accept. Pure.
class Rights {
  public:
    Rights() = default;
    /// `rules`: who may do what; null: everybody may do everything.
    explicit Rights(Stations stations, std::shared_ptr<const access::LineRules> rules = {})
        : stations_(std::move(stations)), rules_(std::move(rules)) {}

    /// Station 0 is a broadcast.
    std::optional<Refusal> judge(std::uint8_t station, const modbus::Request& request) const;
    /// Judges by the rules alone.
    std::optional<Refusal> judge(const WhoRef& who,
                                 const access::LineRules::Question& question) const;
    /// Returns what judge() returns for any write to this station.
    std::optional<Refusal> judge_write(std::uint8_t station) const;

  private:
    std::optional<Refusal> judge_broadcast() const;

    Stations stations_;
    std::shared_ptr<const access::LineRules> rules_;
};

}  // namespace panelgate::bus
