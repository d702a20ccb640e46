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
#include "panelgate/tcp_server/unit_map.hpp"

namespace panelgate::tcp_server {

/// One client as seen by the buses: its identity and the buses it has used.
class Caller {
  public:
    /// `who` is never null. `name` is its address with port, or its serial port, for logs; the
    /// buses show it as `who->name`.
    Caller(std::string name, WhoRef who);

    const std::string& name() const { return name_; }
    const WhoRef& who() const { return who_; }
    std::uint64_t host() const { return who_->host; }
    /// Takes over the client's certificate, before the first request. `role`: the role that the
    /// certificate carries, "" without a role; nothing on a listener that takes no roles from
    /// certificates.
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
/// bus would refuse 01, before any other check; a read of a broadcast unit 0A, and anything else
/// but a write (BC-02) to it 01; a PDU that is inconsistent with its function or cannot be answered
/// 03. Queries the buses only for access rights. `who` asks: what goes to several lines is judged
/// here, everything else where it is submitted.
Decision decide(std::uint8_t unit, ByteView pdu, const Settings& settings, const UnitMap& units,
                bool reads_only = false, const WhoRef& who = {});

}  // namespace panelgate::tcp_server
