#include "account.hpp"

namespace panelgate::bus {

void observe(const Settings& settings, const BusEvent& event) {
    if (settings.observe) settings.observe(event);
}

Account::Account(const Settings& settings) : settings_(settings), counters_(settings.stations) {}

void Account::add(std::uint8_t station, std::uint8_t function, const std::optional<Deed>& deed,
                  Outcome outcome, Duration took) {
    counters_.count(station, function, outcome, took);
    if (deed) log_deed(settings_, station, *deed, outcome);
    observe(settings_, TransactionEvent{station, function, outcome, took});
}

void Account::add_refused(std::uint8_t station, ByteView pdu, ClientId client,
                          const arbiter::ClientNames& names) {
    if (pdu.empty()) return;
    add(station, pdu[0], deed_of(pdu, client, names), Outcome::refused, Duration::zero());
}

}  // namespace panelgate::bus
