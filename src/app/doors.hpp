#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "panelgate/base/time.hpp"
#include "panelgate/base/who.hpp"
#include "panelgate/bus/rights.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/rt/acceptor.hpp"

namespace panelgate::app {

/// True if the list lets a client of this address in; "": it is not known.
bool lets_in(const rt::AccessList& allow, const std::string& address);

/// What the doors of the running configuration say of those who have come in: whose token was taken
/// away, or has another role, meets that while his requests wait, too. Pure.
class Doors {
  public:
    void open(std::shared_ptr<const config::Config> config);
    /// Others from now on. Until settle() whoever has shown a token whose text has changed since is
    /// out: what he sent was sent with the old one.
    void change(std::shared_ptr<const config::Config> config);
    void settle() { renewed_.clear(); }

    /// Nothing if he may what he could when he came in. A listener that is gone answers what it has
    /// taken in.
    std::optional<bus::Admission> admit(const WhoRef& who, WallTime at) const;

  private:
    bool is_allowed(const std::string& listener, const std::string& address) const;
    std::optional<bus::Admission> by_http(const WhoRef& who, WallTime at) const;
    std::optional<bus::Admission> by_modbus(const WhoRef& who) const;
    std::optional<bus::Admission> by_serial(const WhoRef& who) const;
    std::optional<bus::Admission> by_broker(const WhoRef& who) const;

    std::shared_ptr<const config::Config> config_;  ///< null: none is open yet
    std::map<std::string, rt::AccessList> allow_;   ///< by listener; others let everybody in
    std::set<std::string> renewed_;                 ///< tokens by name
};

}  // namespace panelgate::app
