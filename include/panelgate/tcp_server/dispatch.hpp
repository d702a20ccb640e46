#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/tcp_server/settings.hpp"

namespace panelgate::tcp_server {

/// What a listener has to know of a line. The bus outlives every map that names it.
struct LineInfo {
    std::string name;
    bus::BusClient* bus = nullptr;
    std::vector<std::uint8_t> stations;  ///< ids that the configuration lists
    bool pass_unlisted = true;
    friend bool operator==(const LineInfo&, const LineInfo&) = default;
};

/// The station behind a unit id. Station 0 (of an alias) is everybody on that line.
struct Target {
    bus::BusClient* bus = nullptr;
    std::uint8_t station = 0;
};

/// A client's unit id -> line and station, for one listener. Built once, never changes. Pure.
class UnitMap {
  public:
    /// `lines`: at least those that the settings name, in any order. Aliases may point at any of
    /// them; the other rules look only at the listener's own (settings.lines; empty: all given).
    /// Throws std::invalid_argument when the settings name a line that is not there.
    UnitMap(const Settings& settings, const std::vector<LineInfo>& lines);

    /// An alias; a station that exactly one line of the listener lists; on a listener with one line
    /// that passes unlisted stations also the rest of 1..247. Everything else, unit 0 without an
    /// alias and 248..255 included, is Fault::not_routed.
    Result<Target> route(std::uint8_t unit) const;
    /// Where a request to this unit is broadcast: all lines of the listener for unit 0 without an
    /// alias, the one line of an alias to station 0; nowhere for any other unit.
    std::vector<bus::BusClient*> broadcast_lines(std::uint8_t unit) const;
    /// An alias, or a station that the configuration lists.
    bool is_listed(std::uint8_t unit) const { return is_alias(unit) || listed_[unit]; }
    bool is_alias(std::uint8_t unit) const { return aliases_.contains(unit); }
    /// The listener's own lines, in the order of the settings.
    const std::vector<bus::BusClient*>& lines() const { return lines_; }

  private:
    void add_stations(const LineInfo& line);

    std::map<std::uint8_t, Target> aliases_;
    std::array<Target, 256> direct_{};  ///< bus is null where nothing is routed
    std::array<bool, 256> listed_{};
    std::vector<bus::BusClient*> lines_;
};

/// One client as the buses see it: who asks, and which of them were asked.
class Caller {
  public:
    /// `name` is its address with the port, or that of a serial port; connections from one address
    /// share a host. The buses call it PROTOCOL NAME.
    Caller(std::string name, bus::Host host, std::string protocol = "modbus_tcp");

    const std::string& name() const { return name_; }
    bus::Host host() const { return host_; }
    /// Hands the request to a bus, for one of its stations; 0: all of them.
    void transact(bus::BusClient* bus, std::uint8_t station, modbus::Request request,
                  bus::AnswerHandler handler);
    /// Has the bus count what was refused before it was asked.
    void tell_refused(bus::BusClient* bus, std::uint8_t station, ByteView pdu);
    /// Takes back what still waits on the buses; it is answered Fault::cancelled.
    /// May ask again.
    void withdraw();

  private:
    void use(bus::BusClient* bus);

    std::string name_;
    std::string protocol_;
    bus::Host host_;
    bus::ClientId client_ = bus::next_client_id();
    std::set<bus::BusClient*> used_;
};

/// What is to be done with a request.
struct Refuse {
    modbus::ExceptionCode code;
    std::vector<Target> asked{};  ///< whose buses count it as refused
};
struct Forward {
    Target target;
    modbus::Request request;
};
struct Broadcast {
    std::vector<bus::BusClient*> lines;
    modbus::Request request;
};
struct Diagnose {};  ///< the gateway answers from its own registers
using Decision = std::variant<Refuse, Forward, Broadcast, Diagnose>;

/// Judges a request in the order of EXC-08: function 0 or 128..255 is 01; a write through a
/// listener where only reads are allowed 01; a unit that nobody has 0A; a write that its bus would
/// refuse 01, before anything else is said of it; anything but a write (BC-02) to a broadcast unit
/// 01; a PDU that contradicts its function or cannot be answered 03. Asks nobody but for their
/// rights.
Decision decide(std::uint8_t unit, ByteView pdu, const Settings& settings, const UnitMap& units);

}  // namespace panelgate::tcp_server
