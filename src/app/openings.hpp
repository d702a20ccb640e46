#pragma once

#include <boost/system/error_code.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::app {

/// A listener that is to be opened.
struct Door {
    std::string kind;  ///< as the configuration calls it: "modbus_tcp", "http"
    std::string address;
    std::uint16_t port = 0;
    std::function<boost::system::error_code()> open;
    std::function<std::uint16_t()> opened_port;  ///< once it is open
    const void* whose = nullptr;                 ///< for forget()
};

/// A listener that cannot be opened; its text says what helps.
struct CannotListen : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Opens the listeners. An address that the machine does not have yet (after a power cut the
/// network comes late) is no reason to give up: it is tried again until it is there. One thread;
/// the clock outlives it.
class Openings {
  public:
    static constexpr Duration kPause = 500ms;

    explicit Openings(rt::Clock& clock);

    /// Opens all of them, in their order. Throws CannotListen for what time alone does not mend;
    /// then those before it may be open, and nothing more is tried for any of these.
    void open(const std::vector<Door>& doors);
    /// Opens these as soon as it is possible: whoever held their address has just left.
    void take_over(const std::vector<Door>& doors);
    /// Not any more.
    void forget(const void* whose);
    void stop();
    /// Those that do not stand, and why, in words; empty: all stand.
    std::string missing() const;
    /// Those that stand: "modbus_tcp 127.0.0.1:502, http 127.0.0.1:8080".
    std::string standing() const;

  private:
    struct Waiting {
        Door door;
        boost::system::error_code why;
    };
    void try_again();
    void later();
    boost::system::error_code opened(const Door& door);

    rt::Clock& clock_;
    std::unique_ptr<rt::Alarm> again_;
    std::vector<Waiting> waiting_;
    std::vector<std::pair<const void*, std::string>> standing_;  ///< whose, and where
};

/// What somebody can do about a listener that cannot be opened; empty: nothing is known.
std::string listening_advice(const boost::system::error_code& why, std::uint16_t port);

}  // namespace panelgate::app
