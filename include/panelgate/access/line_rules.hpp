#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "panelgate/access/settings.hpp"
#include "panelgate/base/who.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::access {

/// What decides where no rule matches.
inline constexpr std::string_view kDefaultRule = "default";

struct Verdict {
    bool allowed = true;
    const Rule* rule = nullptr;  ///< that decided; null: the default, or a role
    Act act = Act::read;         ///< what was refused, or judged last
    std::string_view role{};     ///< of who asked, where it lacks the right to this act

    std::string_view rule_name() const {
        if (!role.empty()) return role;
        return rule == nullptr ? kDefaultRule : rule->name;
    }
};

/// A rule that matches somebody at a station.
struct RuleAtStation {
    const Rule* rule = nullptr;
    const std::vector<modbus::Span>* items = nullptr;  ///< null: every item
    friend auto operator<=>(const RuleAtStation&, const RuleAtStation&) = default;
};
class Ruling;

/// The rules at the stations of one line. Judging fills a cache, so that many rules cost next to
/// nothing; copies have a cache each. Single-threaded. Pure.
class LineRules {
  public:
    /// Without rules everything is allowed. `settings` is kept. `listed`: the line's stations.
    LineRules() = default;
    LineRules(std::shared_ptr<const Settings> settings, std::string line,
              std::vector<std::uint8_t> listed);

    /// A request as it was asked and, where it was translated, as it is sent.
    struct Question {
        std::uint8_t station = 0;  ///< 0: a broadcast, judged at each station that is known
        const modbus::Request* asked = nullptr;
        const modbus::Request* sent = nullptr;  ///< null: as asked
        bool raw = false;
        /// The acts of the request. A function of a vendor may read and write.
        Acts acts() const;
    };
    /// The gateway's own requests are allowed. Nobody (null) is somebody without role and address.
    Verdict judge(const WhoRef& who, const Question& question) const;
    Verdict judge(const WhoRef& who, std::uint8_t station, const modbus::Request& request) const {
        return judge(who, {.station = station, .asked = &request});
    }
    /// Judges one act on some items, or by a function without items.
    Verdict judge(const WhoRef& who, std::uint8_t station, Act act, std::uint8_t function,
                  const std::optional<modbus::Span>& items) const;

    /// True if some item of the station may be read, or written.
    bool may_some(const WhoRef& who, std::uint8_t station, Act act) const;
    /// True if every item of its tables may be read, or written.
    bool may_all(const WhoRef& who, std::uint8_t station, Act act) const;
    /// True if some item of a listed station may be read, or there is none.
    bool may_read_some(const WhoRef& who) const;
    /// True if both decide alike on any line.
    bool says_the_same(const LineRules& other) const {
        if (settings_ && other.settings_) return *settings_ == *other.settings_;
        return is_open() && other.is_open();
    }
    /// What may refuse: own roles, the names of all rules that deny, then the default. Empty if
    /// nothing does.
    std::vector<std::string> denying_names() const;
    /// True if nothing is ever refused.
    bool is_open() const { return settings_ == nullptr || settings_->is_open(); }

  private:
    /// What somebody meets at a station.
    struct Meeting {
        WhoRef who;  ///< keeps the key's address from being used again
        std::shared_ptr<const Ruling> ruling;
    };
    using Meetings = std::unordered_map<const Who*, Meeting>;

    const Meeting& meet(const WhoRef& who, std::uint8_t station) const;
    std::shared_ptr<const Ruling> ruling_for(const WhoRef& who, std::uint8_t station) const;
    std::vector<RuleAtStation> rules_for(const WhoRef& who, std::uint8_t station) const;
    Verdict judge_request(const WhoRef& who, std::uint8_t station, const Question& question) const;
    Verdict judge_as(const Meeting& meeting, const modbus::Request& request,
                     std::optional<Act> besides) const;
    static Verdict decide(const Meeting& meeting, Act act, std::uint8_t function,
                          const std::optional<modbus::Span>& items);

    std::shared_ptr<const Settings> settings_;
    std::string line_;
    std::vector<std::uint8_t> listed_;
    std::vector<std::uint8_t> known_;  ///< the listed ones, and others that a rule names
    /// By address; a rule's items of stations that are not listed.
    std::vector<std::vector<modbus::Span>> unlisted_items_;
    mutable std::vector<Meetings> meetings_;
    mutable std::size_t met_ = 0;
    mutable std::map<std::vector<RuleAtStation>, std::shared_ptr<const Ruling>> rulings_;
};

/// True if `who` fulfils the conditions on who asks.
bool is_about(const Rule& rule, const Who& who);

}  // namespace panelgate::access
