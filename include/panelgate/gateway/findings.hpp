#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/web/api/sources.hpp"

namespace panelgate::gateway {

/// What a user must know of the gateway itself: lines that are overloaded, a broker that is away,
/// an audit that takes nothing, a reload that was refused, certificates that end. The line doctor's
/// findings are not among these. Logs each change once, and tells it. No timer, no I/O but the log.
class Findings {
  public:
    static constexpr Duration kBrokerMayBeAway = 10s;

    struct Certificate {
        std::string listener;  ///< "http 127.0.0.1:8443"
        std::int64_t end = 0;  ///< in seconds since 1970
    };
    /// The states that findings are made of, as they are now.
    struct State {
        std::vector<web::LineUsage> lines;
        std::string broker_away;   ///< its name; empty: it is there, or none is configured
        std::string audit_fails;   ///< its file; empty: it takes records, or none is configured
        bool writes_stop = false;  ///< ... and with it every write
        std::string store_fails;   ///< its file; empty: it takes events and values
        std::string store_why;
        std::shared_ptr<const web::ReloadVerdict> refused;  ///< the last reload; null: it was taken
        std::vector<Certificate> certificates;
    };

    /// Called with each finding that comes or goes.
    void on_change(std::function<void(const web::Finding&, bool is_new)> tell) {
        tell_ = std::move(tell);
    }
    /// Compares the state with the last one.
    void judge(TimePoint now, WallTime wall, const State& state);
    /// As of the last call of judge().
    const std::vector<web::Finding>& list() const { return list_; }

  private:
    const web::Finding* find(const web::Finding& like) const;
    std::optional<web::Finding> overload(const web::LineUsage& usage) const;
    bool is_broker_away(TimePoint now, const std::string& broker);

    void tell(const web::Finding& finding, bool is_new) const;

    std::function<void(const web::Finding&, bool is_new)> tell_;
    std::vector<web::Finding> list_;
    std::optional<TimePoint> broker_away_since_;
};

}  // namespace panelgate::gateway
