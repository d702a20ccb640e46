#include "write_log.hpp"

#include <algorithm>
#include <cstddef>
#include <string>

#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::bus {

std::optional<Deed> deed_of(const Request& request, const arbiter::ClientNames& names) {
    constexpr std::size_t kShown = 32;  // bytes
    if (request.poll || request.request.is_read()) return std::nullopt;
    Deed deed{names.of(request.client), {}, {}};
    if (const auto written = request.request.access().write)
        deed.place =
            std::string(modbus::label(written->table)) + '/' + std::to_string(written->first);
    const ByteView pdu(request.request.pdu());
    deed.pdu = to_hex(pdu.first(std::min(kShown, pdu.size())));
    std::erase(deed.pdu, ' ');  // as `raw` takes it
    if (pdu.size() > kShown) deed.pdu += "...";
    return deed;
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
