#include "write_log.hpp"

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::bus {

namespace {

/// As `raw` takes it; the first bytes of a long one.
std::string hex_of(ByteView pdu) {
    constexpr std::size_t kShown = 32;  // bytes
    std::string hex = to_hex(pdu.first(std::min(kShown, pdu.size())));
    std::erase(hex, ' ');
    return pdu.size() > kShown ? hex + "..." : hex;
}

std::string place_of(const modbus::Request& request) {
    const auto written = request.access().write;
    if (!written) return "";
    return std::string(modbus::label(written->table)) + '/' + std::to_string(written->first);
}

}  // namespace

std::optional<Deed> deed_of(const Request& request, const arbiter::ClientNames& names) {
    if (request.poll || request.request.is_read()) return std::nullopt;
    return Deed{names.of(request.client), place_of(request.request), hex_of(request.request.pdu()),
                0};
}

std::optional<Deed> deed_of(ByteView pdu, ClientId client, const arbiter::ClientNames& names) {
    if (modbus::is_pure_read(pdu)) return std::nullopt;
    const auto request =
        modbus::Request::make(Bytes(pdu.begin(), pdu.end()), modbus::QuantityCheck::wide);
    return Deed{names.of(client), request ? place_of(*request) : std::string(), hex_of(pdu), 0};
}

void log_deed(const Settings& settings, std::uint8_t station, const Deed& deed, Outcome outcome) {
    const std::string name =
        station == 0 ? std::string("broadcast") : name_of(settings.stations, station);
    // A client's next connection has another port.
    const std::string who = deed.client.substr(0, deed.client.rfind(':'));
    const std::string subject = settings.name + '/' + name + ' ' + deed.place + ' ' + who;
    const std::string ended(label(outcome));
    std::vector<rt::LogField> fields{
        {"line", settings.name}, {"station", name}, {"client", deed.client}};
    if (!deed.place.empty()) fields.push_back({"at", deed.place});
    fields.push_back({"pdu", deed.pdu});
    fields.push_back({"outcome", ended});
    const std::string transaction = std::to_string(deed.transaction);
    if (deed.transaction != 0) fields.push_back({"transaction", transaction});
    rt::log_deed("write", subject, fields);
}

}  // namespace panelgate::bus
