#pragma once

#include <bitset>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "panelgate/base/time.hpp"
#include "panelgate/base/who.hpp"
#include "panelgate/bus/rights.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/explain/unit_map.hpp"
#include "panelgate/rt/acceptor.hpp"

namespace panelgate::explain {

/// True if the list lets a client of this address in; "": it is not known.
bool lets_in(const rt::AccessList& allow, const std::string& address);

/// The stations of each line to which a listener leads; 0: its broadcasts go there.
using Destinations = std::map<std::string, std::bitset<256>, std::less<>>;
/// `listener`: of Modbus/TCP, or what a serial master may ask.
Destinations destinations_of(const tcp_server::Settings& listener, const config::Config& config,
                             Unlisted unlisted);
bool leads_to(const Destinations& reach, std::string_view line, std::uint8_t station);

/// What the doors of the running configuration say of those who have come in: whose token was taken
/// away, or has another role, meets that while his requests wait, too. Pure.
class Doors {
  public:
    void open(std::shared_ptr<const config::Config> config);
    /// Others from now on. Until settle() whoever has shown a token whose text has changed since is
    /// out: what he sent was sent with the old one.
    void change(std::shared_ptr<const config::Config> config);
    void settle() { renewed_.clear(); }

    /// Nothing if the client may still do everything that the client could do at connection. A
    /// removed listener still answers accepted requests.
    std::optional<bus::Admission> admit(const WhoRef& who, std::string_view line,
                                        std::uint8_t station, WallTime at) const;

  private:
    bool is_allowed(const std::string& listener, const std::string& address) const;
    std::optional<bus::Admission> by_http(const WhoRef& who, WallTime at) const;
    /// Of Modbus/TCP, or a port with a serial master.
    std::optional<bus::Admission> by_unit(const WhoRef& who, std::string_view line,
                                          std::uint8_t station) const;
    std::optional<bus::Admission> by_broker(const WhoRef& who) const;

    std::shared_ptr<const config::Config> config_;  ///< null: none is open yet
    std::map<std::string, rt::AccessList> allow_;   ///< by listener; others let everybody in
    struct Door {
        const tcp_server::Settings* listener = nullptr;  ///< of `config_`
        Destinations reach;
    };
    std::map<std::string, Door> doors_;  ///< by listener's or serial master's name
    /// Stations that are known to be listed, or known to be refused as unlisted.
    Destinations plant_;
    std::set<std::string> renewed_;  ///< tokens by name
};

}  // namespace panelgate::explain
