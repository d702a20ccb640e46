#include "load_framing.hpp"

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace panelgate::config {
namespace {

using modbus::Framing;
using modbus::HexDigits;
using tcp_server::BroadcastMode;
using tcp_server::Retransmissions;
using yaml::MapReader;

constexpr std::array<std::string_view, 3> kFramingWords{"tcp", "rtu", "ascii"};
constexpr std::array kFramings{Framing::tcp, Framing::rtu, Framing::ascii};
constexpr std::array<std::pair<std::string_view, HexDigits>, 2> kLowerCase{
    {{"refuse", HexDigits::upper_only}, {"take", HexDigits::any_case}}};
constexpr std::array<std::pair<std::string_view, BroadcastMode>, 3> kBroadcasts{
    {{"reply", BroadcastMode::reply},
     {"silent", BroadcastMode::silent},
     {"deny", BroadcastMode::deny}}};
constexpr std::array<std::pair<std::string_view, Retransmissions>, 2> kRetransmissions{
    {{"join", Retransmissions::join}, {"pass", Retransmissions::pass}}};

std::string framing_hint(std::string_view typed) {
    return typed == "udp" ? "; datagrams have framing: tcp, write udp: true" : "";
}

std::string framing_is(Framing framing) {
    return "framing: " + std::string(modbus::label(framing));
}

/// What RTU and ASCII have no means for.
void refuse_in_serial_modes(MapReader& in, const tcp_server::Settings& settings) {
    const std::string here = " with " + framing_is(settings.framing);
    if (in.has("broadcast") && settings.broadcast == BroadcastMode::reply)
        in.problem("broadcast", "nobody is answered at unit 0" + here +
                                    "; write silent or deny, or leave it out for silent");
    if (settings.retransmissions == Retransmissions::join)
        in.problem("retransmissions", "requests have no transaction id" + here +
                                          ", so none is known again; leave it out");
    if (settings.udp)
        in.problem("udp",
                   "udp is for framing: tcp, where a datagram is one ADU; leave it out" + here);
}

}  // namespace

void load_framing(MapReader& in, tcp_server::Settings& settings) {
    if (const auto chosen = in.choice_index("framing", kFramingWords, framing_hint))
        settings.framing = kFramings[*chosen];
    settings.udp = in.boolean("udp").value_or(settings.udp);
    settings.ascii_digits =
        in.choice<HexDigits>("ascii_lower_case", kLowerCase).value_or(settings.ascii_digits);
    settings.broadcast =
        in.choice<BroadcastMode>("broadcast", kBroadcasts).value_or(settings.broadcast);
    settings.retransmissions = in.choice<Retransmissions>("retransmissions", kRetransmissions)
                                   .value_or(settings.retransmissions);
    in.belongs("ascii_lower_case", "framing", std::span(&kFramingWords[2], 1));
    if (in.has("ascii_lower_case") && settings.framing != Framing::ascii)
        in.problem("ascii_lower_case", "only a listener with framing: ascii reads hex digits");
    if (settings.framing != Framing::tcp) refuse_in_serial_modes(in, settings);
}

}  // namespace panelgate::config
