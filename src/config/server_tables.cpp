#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/base/serial_format.hpp"
#include "tables.hpp"

namespace panelgate::config {
namespace {

using yaml::format_duration;

std::string names_text(const std::vector<std::string>& names) {
    return listed(names, [](const std::string& name) { return name; });
}

std::string networks_text(const std::vector<Network>& allow) {
    if (allow.empty()) return "all";
    return listed(allow, [](const Network& network) {
        return network.address + '/' + std::to_string(network.prefix);
    });
}

}  // namespace

const Keys<tcp_server::Settings>& access_keys() {
    using Settings = tcp_server::Settings;
    static const auto kKeys =
        Keys<Settings>()
            .other("lines",
                   "Names of lines; for a serial master those whose listed stations it may ask.",
                   [](const Settings& settings) { return names_text(settings.lines); })
            .other("units",
                   "Further unit ids, LINE/STATION each; where two lines have one id, they need "
                   "them.")
            .other("access", "read_only refuses whatever writes.",
                   [](const Settings& settings) { return access_text(settings.read_only); })
            .initially("read_write");
    return kKeys;
}

const Keys<tcp_server::Settings>& listener_keys() {
    using Settings = tcp_server::Settings;
    using tcp_server::BroadcastMode;
    using tcp_server::Retransmissions;
    static constexpr Words<BroadcastMode, 3> kBroadcasts{{{"reply", BroadcastMode::reply},
                                                          {"silent", BroadcastMode::silent},
                                                          {"deny", BroadcastMode::deny}}};
    static constexpr Words<Retransmissions, 2> kRetransmissions{
        {{"join", Retransmissions::join}, {"pass", Retransmissions::pass}}};
    static const auto kKeys =
        Keys<Settings>()
            .other("listen", "ADDR:PORT or [ADDR]:PORT; port 0 takes a free one.")
            .initially("127.0.0.1:502")
            .change_needs(kListensAnew)
            .other("framing", "The framing of its clients, over TCP.",
                   [](const Settings& settings) {
                       return std::string(modbus::label(settings.framing));
                   })
            .initially("tcp")
            .change_needs(kListensAnew)
            .boolean("udp", &Settings::udp, "The same port for datagrams, too.")
            .change_needs(kListensAnew)
            .word("ascii_lower_case", &Settings::ascii_digits, kLowerCase,
                  "Hex digits a-f, of framing ascii.")
            .change_needs(kListensAnew)
            .word("broadcast", &Settings::broadcast, kBroadcasts,
                  "Unit 0: reply (once sent; without the key, with framing tcp), silent, deny "
                  "(exception 01).")
            .initially("")
            .word("retransmissions", &Settings::retransmissions, kRetransmissions,
                  "The same id, unit and bytes while the first is unanswered: join has one answer "
                  "and one frame; without the key writes are joined.")
            .initially("")
            .shown_as([](const Settings& settings) {
                constexpr std::array<const char*, 3> kWords{"join writes", "join", "pass"};
                return kWords[static_cast<std::size_t>(settings.retransmissions)];
            })
            .other("diagnostics_unit", "The gateway's own registers; null: none.",
                   [](const Settings& settings) {
                       const auto& unit = settings.diagnostics_unit;
                       return unit ? std::to_string(*unit) : std::string("null");
                   })
            .initially("255")
            .other("allow", "Networks such as 192.168.1.0/24; any address without.",
                   [](const Settings& settings) { return networks_text(settings.allow); })
            .integer("max_connections", &Settings::max_connections, 1, 65535, "Of all clients.")
            .integer("max_connections_per_address", &Settings::max_connections_per_address, 1,
                     65535, "Of one client; then its longest idle one gives way.");
    return kKeys;
}

const Keys<serial_server::Settings>& master_keys() {
    using serial_server::OnFailure;
    using serial_server::Settings;
    using tcp_server::BroadcastMode;
    static constexpr Words<modbus::Framing, 2> kFramings{
        {{"rtu", modbus::Framing::rtu}, {"ascii", modbus::Framing::ascii}}};
    static constexpr Words<BroadcastMode, 2> kBroadcasts{
        {{"silent", BroadcastMode::silent}, {"deny", BroadcastMode::deny}}};
    static constexpr Words<OnFailure, 2> kFailures{
        {{"exception", OnFailure::exception}, {"silence", OnFailure::silence}}};
    static const auto kKeys =
        Keys<Settings>()
            .other("name", "Unique: a-z, 0-9 and '-'.")
            .other("device", "A serial device.")
            .other("serial", "How characters look there.")
            .other("rs485", "How the transceiver is switched.")
            .word(
                "framing", [](auto& master) -> auto& { return master.access.framing; }, kFramings,
                "The framing of the master.")
            .initially("rtu")
            .word(
                "broadcast", [](auto& master) -> auto& { return master.access.broadcast; },
                kBroadcasts, "Unit 0: silent, or deny.")
            .initially("silent")
            .word("on_failure", &Settings::on_failure, kFailures,
                  "What it gets when a panel does not answer.")
            .word("echo", &Settings::echo, kEchoes, "The adapter hears itself; auto: found out.")
            .other("response_timeout", "The master's own: what would begin later is not sent.",
                   [](const Settings& settings) {
                       const auto& timeout = settings.response_timeout;
                       return timeout ? format_duration(*timeout) : "none";
                   });
    return kKeys;
}

const Keys<web::Settings>& http_keys() {
    using web::Role;
    using web::Settings;
    static constexpr Words<Role, 3> kRoles{
        {{"none", Role::none}, {"viewer", Role::viewer}, {"operator", Role::operator_}}};
    static const auto kKeys =
        Keys<Settings>()
            .other("listen", "ADDR:PORT or [ADDR]:PORT.",
                   [](const Settings& settings) { return settings.name(); })
            .initially("127.0.0.1:8080")
            .change_needs(kListensAnew)
            .word("anonymous", &Settings::anonymous, kRoles,
                  "Without a token: none, viewer (read), operator (read and write).")
            .other("hosts",
                   "Its names in URLs, the machine's without; its addresses and localhost always. "
                   "Another name is answered 421.",
                   [](const Settings& settings) {
                       return settings.hosts.empty() ? "the machine's" : names_text(settings.hosts);
                   })
            .other("allow", "Networks such as 192.168.1.0/24; any address without.",
                   [](const Settings& settings) { return networks_text(settings.allow); })
            .other("tokens", "Who may do what: Authorization: Bearer TOKEN.")
            .integer(
                "max_connections_per_address", &Settings::max_connections_per_address, 1,
                static_cast<std::int64_t>(Settings().max_connections),
                "Of one client; then its longest idle one gives way. Streams of events apart.");
    return kKeys;
}

const Keys<web::Token>& token_keys() {
    static const auto kKeys =
        Keys<web::Token>()
            .other("name", "Unique; it is in the log.")
            .other("role", "viewer reads, operator writes as well.",
                   [](const web::Token& token) { return std::string(label(token.role)); })
            .other("file", "Holds the token, and nothing else.");
    return kKeys;
}

const Keys<points::Relay>& relay_keys() {
    using points::Relay;
    static const auto kKeys =
        Keys<Relay>()
            .other("from", "STATION/NOTATION: press/UW100.")
            .other("to", "STATION/NOTATION.")
            .integer("count", &Relay::count, 1, 2040, "Registers or bits.")
            .duration("every", &Relay::every, 1ms, points::kSlowest, "How often it is read.")
            .boolean("on_change", &Relay::on_change, "Write only what has changed.")
            .duration("refresh", &Relay::refresh, 1s, points::kSlowest,
                      "With on_change: and all again that often. What other clients write there is "
                      "written over within a second.");
    return kKeys;
}

const Keys<mqtt::Settings>& mqtt_keys() {
    using mqtt::Settings;
    static constexpr Words<mqtt::Format, 2> kFormats{
        {{"json", mqtt::Format::json}, {"sparkplug", mqtt::Format::sparkplug}}};
    static constexpr Words<bool, 2> kWrites{{{"none", false}, {"points", true}}};
    const auto text = [](std::string Settings::* member) {
        return [member](const Settings& settings) {
            return (settings.*member).empty() ? std::string("default") : settings.*member;
        };
    };
    static const auto kKeys =
        Keys<Settings>()
            .other("broker", "mqtt://HOST:1883, or mqtts://HOST:8883 with TLS.",
                   [](const Settings& settings) { return settings.broker(); })
            .word("format", &Settings::format, kFormats,
                  "sparkplug has group and node in place of the topic.")
            .other("topic", "TOPIC/STATION/POINT, of format json.", text(&Settings::topic))
            .initially("panelgate")
            .other("group", "Of format sparkplug.", text(&Settings::group))
            .other("node", "Of format sparkplug.", text(&Settings::node))
            .integer("qos", &Settings::qos, 0, 1,
                     "Of format json; 0: what is on its way may be lost.")
            .other("client_id", "panelgate- and the machine's name without.",
                   text(&Settings::client_id))
            .other("username", "The broker's user; none without.", text(&Settings::username))
            .other("password_file", "Holds the password.")
            .duration("keep_alive", &Settings::keep_alive, 5s, 1h, "In whole seconds.")
            .integer("store", &Settings::store, 100, 1'000'000,
                     "Changes that are kept while the broker is away.")
            .word("write", &Settings::write, kWrites,
                  "points: clients that may publish TOPIC/+/+/set, or DCMD, write.")
            .other("ca", "A PEM file, with mqtts://; the system's trusted CAs without.",
                   text(&Settings::ca))
            .other("certificate", "The gateway's own, a PEM file.", text(&Settings::certificate))
            .other("key", "Of the certificate, a PEM file.", text(&Settings::key));
    return kKeys;
}

}  // namespace panelgate::config
