#include "panelgate/tcp_server/caller.hpp"

#include <utility>

namespace panelgate::tcp_server {

Caller::Caller(std::string name, bus::Host host, std::string protocol)
    : name_(std::move(name)), protocol_(std::move(protocol)), host_(host) {}

void Caller::transact(bus::BusClient* bus, std::uint8_t station, modbus::Request request,
                      bus::AnswerHandler handler) {
    use(bus);
    bus->transact(
        {.station = station, .request = std::move(request), .client = client_, .host = host_},
        std::move(handler));
}

void Caller::tell_refused(bus::BusClient* bus, std::uint8_t station, ByteView pdu) {
    use(bus);
    bus->tell_refused(station, pdu, client_);
}

/// It has a name there before it does anything.
void Caller::use(bus::BusClient* bus) {
    if (used_.insert(bus).second) bus->name_client(client_, protocol_ + ' ' + name_);
}

void Caller::withdraw() {
    // An answer may end the connection meanwhile.
    const std::set<bus::BusClient*> buses = std::exchange(used_, {});
    for (bus::BusClient* bus : buses) bus->cancel(client_);
}

}  // namespace panelgate::tcp_server
