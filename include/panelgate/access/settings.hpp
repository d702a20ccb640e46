#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/network.hpp"
#include "panelgate/base/role.hpp"
#include "panelgate/base/who.hpp"
#include "panelgate/modbus/function.hpp"

namespace panelgate::access {

/// What a request does to a station. A raw request of REST also reads or writes, and a broadcast
/// also writes: each of these has to be allowed.
enum class Act : std::uint8_t { read, write, broadcast, raw };
/// Returns its name in the configuration.
std::string_view label(Act act);
/// Returns the right of a role that it takes.
Right right_of(Act act);

/// A set of them.
class Acts {
  public:
    constexpr Acts() = default;
    constexpr Acts(std::initializer_list<Act> acts) {
        for (const Act act : acts) add(act);
    }
    constexpr void add(Act act) { bits_ = static_cast<std::uint8_t>(bits_ | bit(act)); }
    constexpr bool has(Act act) const { return (bits_ & bit(act)) != 0; }
    constexpr bool empty() const { return bits_ == 0; }
    friend bool operator==(const Acts&, const Acts&) = default;

  private:
    static constexpr std::uint8_t bit(Act act) {
        return static_cast<std::uint8_t>(1U << static_cast<unsigned>(act));
    }
    std::uint8_t bits_ = 0;
};

/// A station by its line and address.
using Place = std::pair<std::string, std::uint8_t>;

/// One rule. An empty list is no condition; all conditions must hold.
struct Rule {
    std::string name{};
    bool allow = false;
    Acts acts{};
    std::vector<Network> from{};           ///< a client without an address is in no network
    std::vector<std::string> roles{};      ///< of the role, or in the words of a certificate
    std::vector<std::string> tokens{};     ///< by name
    std::vector<Face> faces{};             ///< modbus_tcp includes udp
    std::vector<std::string> listeners{};  ///< ADDRESS:PORT, or a serial master's name
    std::vector<Place> stations{};
    std::vector<std::uint8_t> functions{};
    std::string range{};  ///< as typed; empty: every item
    /// The items of the range, by station. Of a rule that denies: all items that show this memory;
    /// of a rule that allows: only items that show no other memory.
    std::map<Place, std::vector<modbus::Span>> items{};
    /// The same for a station that is not listed; only of a range by table and address.
    std::optional<modbus::Span> unlisted_items{};
    int line = 0;  ///< where it stands in the file; 0: nowhere
    int column = 0;

    bool has_range() const { return !range.empty(); }
    friend bool operator==(const Rule&, const Rule&) = default;
};

/// Who may do what: the first rule that matches an item decides. Pure data.
struct Settings {
    static constexpr std::size_t kMaxRules = 1000;
    static constexpr std::size_t kMaxRoles = 64;

    bool allow_by_default = true;  ///< where no rule matches
    std::vector<Rule> rules;
    /// Roles besides the default roles. An act without the right of its role is refused before any
    /// rule.
    std::vector<OwnRole> roles{};

    /// True if nothing is ever refused.
    bool is_open() const { return allow_by_default && rules.empty(); }
    friend bool operator==(const Settings&, const Settings&) = default;
};

}  // namespace panelgate::access
