#include "write_log.hpp"

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/network.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::bus {

void log_event(const Settings& settings, const arbiter::StationEvent& event) {
    const std::string station = name_of(settings.stations, event.station);
    const std::string ms = std::to_string(std::lround(std::ceil(to_milliseconds(event.by))));
    const auto say = [&](rt::LogLevel level, const char* what, const std::string& hint) {
        if (hint.empty()) {
            rt::log(level, what, {{"line", settings.name}, {"station", station}});
        } else {
            rt::log(level, what, {{"line", settings.name}, {"station", station}, {"hint", hint}});
        }
    };
    switch (event.kind) {
        case arbiter::StationEvent::Kind::offline:
            return say(rt::LogLevel::warn, "station offline", "");
        case arbiter::StationEvent::Kind::online:
            return say(rt::LogLevel::info, "station online", "");
        case arbiter::StationEvent::Kind::suspect:
        case arbiter::StationEvent::Kind::heard:
        case arbiter::StationEvent::Kind::unknown:
            return;
        case arbiter::StationEvent::Kind::late:
            // After a shortened wait the settings are not at fault.
            if (event.by <= Duration::zero()) return say(rt::LogLevel::info, "late reply", "");
            return say(rt::LogLevel::warn, "late reply",
                       "raise its response_timeout by at least " + ms + "ms");
        case arbiter::StationEvent::Kind::drift:
            return say(rt::LogLevel::warn, "station has become slow",
                       "it takes up to " + ms + "ms, near its response_timeout; raise that");
        case arbiter::StationEvent::Kind::collision:
            return say(rt::LogLevel::warn, "collision",
                       "the echo is not what was sent: is there another master, or no echo?");
        case arbiter::StationEvent::Kind::echo:
            return say(
                settings.arbiter.echo == EchoMode::off ? rt::LogLevel::warn : rt::LogLevel::info,
                "line hears itself", "its echo is checked and taken out");
        case arbiter::StationEvent::Kind::trail:
            return say(rt::LogLevel::warn, "bytes behind its replies",
                       "the line now waits up to " + ms +
                           "ms for them; look at how its transceiver lets go of the line");
    }
}

namespace {

/// Format of the `raw` request.
std::string hex_of(ByteView pdu) {
    std::string hex = to_hex(pdu);
    std::erase(hex, ' ');
    return hex;
}

/// Shortens a request that had no effect: there may be many of these.
std::string shortened(const std::string& hex) {
    constexpr std::size_t kShown = 64;
    return hex.size() > kShown ? hex.substr(0, kShown) + "..." : hex;
}

/// False for reads, 0 and exception codes (128 and above), which are not functions.
bool may_write(ByteView pdu) { return !modbus::is_pure_read(pdu) && pdu[0] != 0 && pdu[0] < 0x80; }

/// The write was transmitted or executed: a panel may have changed.
bool is_accepted(const WriteRecord& write, Outcome outcome) {
    return write.transaction != 0 || outcome == Outcome::ok;
}

std::string place_of(const modbus::Request& request) {
    const auto written = request.access().write;
    if (!written) return "";
    return std::string(modbus::label(written->table)) + '/' + std::to_string(written->first);
}

}  // namespace

std::optional<WriteRecord> write_record_of(const Request& request,
                                           const arbiter::ClientNames& names) {
    if (request.poll || !may_write(request.request.pdu())) return std::nullopt;
    return WriteRecord{names.of(request.client), place_of(request.request),
                       hex_of(request.request.pdu()), 0};
}

std::optional<WriteRecord> write_record_of(ByteView pdu, ClientId client,
                                           const arbiter::ClientNames& names) {
    if (!may_write(pdu)) return std::nullopt;
    const auto request =
        modbus::Request::make(Bytes(pdu.begin(), pdu.end()), modbus::QuantityCheck::wide);
    return WriteRecord{names.of(client), request ? place_of(*request) : std::string(), hex_of(pdu),
                       0};
}

void log_write(const Settings& settings, std::uint8_t station, const WriteRecord& write,
               Outcome outcome) {
    const std::string name =
        station == 0 ? std::string("broadcast") : name_of(settings.stations, station);
    const std::string client = without_port(write.client);
    const std::string place = settings.name + '/' + name + ' ' + write.place;
    const std::string ended(label(outcome));
    const bool accepted = is_accepted(write, outcome);
    std::vector<rt::LogField> fields{
        {"line", settings.name}, {"station", name}, {"client", write.client}};
    if (!write.place.empty()) fields.push_back({"at", write.place});
    fields.push_back({"pdu", accepted ? write.pdu : shortened(write.pdu)});
    fields.push_back({"outcome", ended});
    const std::string transaction = std::to_string(write.transaction);
    if (write.transaction != 0) fields.push_back({"transaction", transaction});
    if (!accepted) return rt::log_collapsed("write", place + ' ' + client, fields);
    rt::log_each("write", place, client + ' ' + write.pdu + ' ' + ended, fields);
}

}  // namespace panelgate::bus
