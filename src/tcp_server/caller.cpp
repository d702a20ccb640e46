#include "caller.hpp"

#include <utility>

#include "panelgate/modbus/request.hpp"

namespace panelgate::tcp_server {

Caller::Caller(std::string name, bus::Host host) : name_(std::move(name)), host_(host) {}

void Caller::transact(bus::BusClient* bus, std::uint8_t station, const modbus::Adu& adu,
                      bus::AnswerHandler handler) {
    if (used_.insert(bus).second) bus->name_client(client_, "modbus_tcp " + name_);
    bus::Request request;
    request.station = station;
    request.pdu = adu.pdu;
    request.client = client_;
    request.host = host_;
    request.priority = modbus::is_pure_read(adu.pdu) ? PriorityClass::read : PriorityClass::write;
    bus->transact(std::move(request), std::move(handler));
}

void Caller::withdraw() {
    const std::set<bus::BusClient*> buses = used_;  // an answer may end the connection meanwhile
    for (bus::BusClient* bus : buses) bus->cancel(client_);
}

}  // namespace panelgate::tcp_server
