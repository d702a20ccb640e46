#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace panelgate {

/// What somebody may do, least first; each includes those before it.
enum class Role : std::uint8_t {
    none,
    viewer,     ///< reads
    operator_,  ///< writes, acknowledges alarms
    engineer,   ///< raw requests, broadcasts, discoveries, simulated faults
    admin,      ///< reload and rollback, and the text of the configuration
};
/// Returns its name in the configuration.
std::string_view label(Role role);

/// What a role of the configuration is made of.
enum class Right : std::uint8_t {
    read,
    write,
    broadcast,
    raw,
    discover,
    simulator,
    reload,       ///< and rollback
    acknowledge,  ///< alarms
    configure,    ///< read, judge and write the configuration's text, which includes all else
};
inline constexpr std::array kAllRights{Right::read,   Right::write,       Right::broadcast,
                                       Right::raw,    Right::discover,    Right::simulator,
                                       Right::reload, Right::acknowledge, Right::configure};
/// Returns its name in the configuration.
std::string_view label(Right right);

/// A set of them.
class Rights {
  public:
    constexpr void add(Right right) { bits_ = static_cast<std::uint16_t>(bits_ | bit(right)); }
    constexpr bool has(Right right) const { return (bits_ & bit(right)) != 0; }
    constexpr bool empty() const { return bits_ == 0; }
    friend bool operator==(const Rights&, const Rights&) = default;

  private:
    static constexpr std::uint16_t bit(Right right) {
        return static_cast<std::uint16_t>(1U << static_cast<unsigned>(right));
    }
    std::uint16_t bits_ = 0;
};

/// A role of the configuration, besides the default ones.
struct OwnRole {
    std::string name{};
    Rights rights{};
    friend bool operator==(const OwnRole&, const OwnRole&) = default;
};

/// Somebody's role: a default one, or one of the configuration.
struct Standing {
    Role role = Role::none;  ///< of an own role: the least default one that has all its rights
    std::optional<OwnRole> own{};

    /// A default role is one.
    Standing(Role role = Role::none, std::optional<OwnRole> own = {});

    bool may(Right right) const;
    /// True if it may something that the other may not.
    bool exceeds(const Standing& other) const;
    std::string_view name() const { return own ? std::string_view(own->name) : label(role); }
    friend bool operator==(const Standing&, const Standing&) = default;
};
/// As much of it as is reading: of what others may without a role, what counts for a certificate
/// whose own does not.
Standing only_reading(const Standing& anonymous);
/// A default role, or one of these; `none`, the least, for every other word.
Standing standing_named(std::string_view word, std::span<const OwnRole> own);
/// The least default role that has all of these rights.
Role least_with(const Rights& rights);
/// What a default role may do.
Rights rights_of(Role role);

}  // namespace panelgate
