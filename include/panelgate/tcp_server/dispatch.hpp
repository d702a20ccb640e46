#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/base/who.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/tcp_server/settings.hpp"

namespace panelgate::tcp_server {

/// What a listener needs to know about a line. The bus outlives every map that refers to it.
struct LineInfo {
    std::string name;
    bus::BusClient* bus = nullptr;
    std::vector<std::uint8_t> stations;  ///< configured station addresses
    bool pass_unlisted = true;
    friend bool operator==(const LineInfo&, const LineInfo&) = default;
};

/// The station behind a unit id. Station 0 (from an alias) is a broadcast to that line.
struct Target {
    bus::BusClient* bus = nullptr;
    std::uint8_t station = 0;
};

/// Routes a client's unit id to a line and station, for one listener. Immutable. Pure.
class UnitMap {
  public:
    /// `lines`: at least those named by the settings, in any order. Aliases may refer to any of
    /// them; the other rules apply only to the listener's own (settings.lines; empty: all given).
    /// Throws std::invalid_argument if the settings name an unknown line.
    UnitMap(const Settings& settings, const std::vector<LineInfo>& lines);

    /// Returns the target of an alias, or of a station listed by exactly one line of the listener;
    /// on a listener with a single line that passes unlisted stations, also of the rest of 1..247.
    /// Everything else, including unit 0 without an alias and 248..255, is Fault::not_routed.
    Result<Target> route(std::uint8_t unit) const;
    /// Returns the lines a request to this unit is broadcast to: all of the listener's for unit 0
    /// without an alias, one for an alias to station 0, none for any other unit.
    std::vector<bus::BusClient*> broadcast_lines(std::uint8_t unit) const;
    /// True for an alias or a configured station.
    bool is_listed(std::uint8_t unit) const { return is_alias(unit) || listed_[unit]; }
    bool is_alias(std::uint8_t unit) const { return aliases_.contains(unit); }
    /// Returns the listener's own lines, in the order of the settings.
    const std::vector<bus::BusClient*>& lines() const { return lines_; }

  private:
    void add_stations(const LineInfo& line);

    std::map<std::uint8_t, Target> aliases_;
    std::array<Target, 256> direct_{};  ///< bus is null for unrouted units
    std::array<bool, 256> listed_{};
    std::vector<bus::BusClient*> lines_;
};

/// One client as seen by the buses: its identity and the buses it has used.
class Caller {
  public:
    /// `who` is never null. `name` is its address with port, or its serial port, for logs; the
    /// buses show it as `who->name`.
    Caller(std::string name, WhoRef who);

    const std::string& name() const { return name_; }
    const WhoRef& who() const { return who_; }
    std::uint64_t host() const { return who_->host; }
    /// What its certificate says. `role` is the one in it, "" none, which is the least; nothing
    /// where its listener does not go by that. Call it before the first request.
    void certify(std::string subject, std::optional<std::string> role,
                 std::span<const OwnRole> own_roles = {});
    /// By its certificate: only operators and above write, and own roles with that right.
    bool reads_only() const { return by_certificate_ && !who_->standing.may(Right::write); }
    /// Passes the request to a bus for one of its stations; station 0: broadcast.
    void transact(bus::RequestPort* bus, std::uint8_t station, modbus::Request request,
                  bus::AnswerHandler handler);
    /// Makes the bus count a request refused before it reached the bus.
    void count_refused(bus::RequestPort* bus, std::uint8_t station, ByteView pdu);
    /// Cancels its requests still queued on the buses (answered Fault::cancelled). Further requests
    /// are allowed.
    void withdraw();

  private:
    void use(bus::RequestPort* bus);

    std::string name_;
    WhoRef who_;
    bus::ClientId client_ = bus::next_client_id();
    bool by_certificate_ = false;  ///< its role is its certificate's
    std::set<bus::RequestPort*> used_;
};

/// Hears of a client's write that comes to no line, whose bus would tell of it: to a unit that
/// leads nowhere or to the gateway's own registers, where nothing is writable, or malformed beyond
/// that.
using StrayWrite = std::function<void(const WhoRef& who, std::uint8_t unit, ByteView pdu)>;

/// What to do with a request.
struct Refuse {
    modbus::ExceptionCode code;
    std::vector<Target> asked{};  ///< their buses count it as refused
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

/// Decides on a request in the order of EXC-08: function 0 or 128..255 is 01; a write through a
/// read-only listener, or by a client that only reads, 01; an unrouted unit 0A; a write that its
/// bus would refuse 01, before any other check; anything but a write (BC-02) to a broadcast unit
/// 01; a PDU that is inconsistent with its function or cannot be answered 03. Queries the buses
/// only for access rights. `who` asks: what goes to several lines is judged here, everything else
/// where it is submitted.
Decision decide(std::uint8_t unit, ByteView pdu, const Settings& settings, const UnitMap& units,
                bool reads_only = false, const WhoRef& who = {});

}  // namespace panelgate::tcp_server
