#pragma once

#include <cstdint>
#include <set>
#include <string>

#include "panelgate/base/bytes.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::tcp_server {

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

}  // namespace panelgate::tcp_server
