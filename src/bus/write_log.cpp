#include "write_log.hpp"

#include <algorithm>
#include <cstddef>
#include <string>

#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/function.hpp"
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

}  // namespace

std::optional<Deed> deed_of(const Request& request, const arbiter::ClientNames& names) {
    if (request.poll || request.request.is_read()) return std::nullopt;
    Deed deed{names.of(request.client), {}, {}};
    if (const auto written = request.request.access().write)
        deed.place =
            std::string(modbus::label(written->table)) + '/' + std::to_string(written->first);
    deed.pdu = hex_of(request.request.pdu());
    return deed;
}

std::optional<Deed> deed_of(ByteView pdu, ClientId client, const arbiter::ClientNames& names) {
    if (modbus::is_pure_read(pdu)) return std::nullopt;
    return Deed{names.of(client), {}, hex_of(pdu)};
}

void log_deed(const Settings& settings, std::uint8_t station, const Deed& deed, Outcome outcome) {
    const std::string name =
        station == 0 ? std::string("broadcast") : name_of(settings.stations, station);
    // A client's next connection has another port.
    const std::string who = deed.client.substr(0, deed.client.rfind(':'));
    rt::log_deed("write", settings.name + '/' + name + ' ' + deed.place + ' ' + who,
                 {{"line", settings.name},
                  {"station", name},
                  {"client", deed.client},
                  {"at", deed.place},
                  {"pdu", deed.pdu},
                  {"outcome", std::string(label(outcome))}});
}

}  // namespace panelgate::bus
