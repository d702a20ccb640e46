#include <optional>
#include <string>
#include <vector>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/config/endpoint.hpp"
#include "panelgate/yaml/document.hpp"
#include "tables.hpp"

namespace panelgate::config {
namespace {

using yaml::format_duration;

}  // namespace

const Keys<tcp_server::Settings>& access_keys() {
    using Settings = tcp_server::Settings;
    static const auto kKeys =
        Keys<Settings>()
            .other("lines",
                   "Lines that are served; of a serial master those whose listed stations "
                   "it may ask. Without it all.",
                   &Settings::lines)
            .other("units",
                   "Further unit ids (0 to 255, of a serial master 1 to 247), each to "
                   "LINE/STATION; needed where two lines have the same station id.")
            .other("access", "read_only refuses every write.",
                   [](const Settings& settings) { return access_text(settings.read_only); })
            .initially("read_write");
    return kKeys;
}

const Keys<tcp_server::Settings>& listener_keys() {
    using Settings = tcp_server::Settings;
    using tcp_server::BroadcastMode;
    using tcp_server::Retransmissions;
    static constexpr Words<modbus::Framing, 3> kFramings{{{"tcp", modbus::Framing::tcp},
                                                          {"rtu", modbus::Framing::rtu},
                                                          {"ascii", modbus::Framing::ascii}}};
    static constexpr Words<BroadcastMode, 3> kBroadcasts{{{"reply", BroadcastMode::reply},
                                                          {"silent", BroadcastMode::silent},
                                                          {"deny", BroadcastMode::deny}}};
    static constexpr Words<Retransmissions, 2> kRetransmissions{
        {{"join", Retransmissions::join}, {"pass", Retransmissions::pass}}};
    static const auto kKeys =
        Keys<Settings>()
            .other("listen", "ADDR:PORT or [ADDR]:PORT; port 0: a free one.", &Settings::name)
            .initially("127.0.0.1:502")
            .change_needs(kListensAnew)
            .word("framing", &Settings::framing, kFramings,
                  "Framing of its clients' requests, over TCP.",
                  [](std::string_view typed) {
                      return typed == "udp" ? "; datagrams have framing: tcp, write udp: true" : "";
                  })
            .change_needs(kListensAnew)
            .boolean("udp", &Settings::udp,
                     "Takes datagrams on the same port as well, with framing tcp.")
            .change_needs(kListensAnew)
            .word("ascii_lower_case", &Settings::ascii_digits, kLowerCase,
                  "Whether hex digits a-f are taken.")
            .change_needs(kListensAnew)
            .word("broadcast", &Settings::broadcast, kBroadcasts,
                  "Answer to a write to unit 0: reply (once it is sent; with framing tcp), "
                  "silent, or deny (exception 01). Without it reply with framing tcp, else silent.")
            .initially("")
            .shown_if([](const Settings& settings) {
                return settings.framing == modbus::Framing::tcp ||
                       settings.broadcast != BroadcastMode::reply;
            })
            .word("retransmissions", &Settings::retransmissions, kRetransmissions,
                  "With framing tcp, a request that comes again (same transaction id, unit and "
                  "bytes) before its answer: join has one frame and one answer, pass takes it "
                  "for another one. Without it writes are joined.")
            .initially("")
            .other("diagnostics_unit", "Unit id of the gateway's own registers; null: none.",
                   [](const Settings& settings) {
                       const auto& unit = settings.diagnostics_unit;
                       return unit ? std::to_string(*unit) : std::string("null");
                   })
            .initially("255")
            .other("allow",
                   "Networks whose clients may connect, such as 192.168.1.0/24. Without it any.",
                   &Settings::allow)
            .change_needs(kAllowCloses)
            .integer("max_connections", &Settings::max_connections, 1, 65535,
                     "Most connections of all clients.")
            .integer("max_connections_per_address", &Settings::max_connections_per_address, 1,
                     65535, "Most connections of one address; then its longest idle one is closed.")
            .other(
                "tls",
                "Modbus/TCP Security: only clients that speak TLS are served. `listen` may be an "
                "address alone then: its port is 802, as it is of the default, 127.0.0.1.")
            .change_needs(kTlsCloses);
    return kKeys;
}

const Keys<serial_server::Settings>& master_keys() {
    using serial_server::OnFailure;
    using serial_server::Settings;
    using tcp_server::BroadcastMode;
    static constexpr Words<modbus::Framing, 2> kMasterFramings{
        {{"rtu", modbus::Framing::rtu}, {"ascii", modbus::Framing::ascii}}};
    static constexpr Words<BroadcastMode, 2> kBroadcasts{
        {{"silent", BroadcastMode::silent}, {"deny", BroadcastMode::deny}}};
    static constexpr Words<OnFailure, 2> kFailures{
        {{"exception", OnFailure::exception}, {"silence", OnFailure::silence}}};
    static const auto kKeys =
        Keys<Settings>()
            .other("name", "Unique: a-z, 0-9 and '-'.", &Settings::name)
            .other("device", "Serial port that the master is connected to.")
            .change_needs(kOpensPort)
            .other("serial", "Character format.")
            .change_needs(kOpensPort)
            .other("rs485", "Direction control of an RS-485 transceiver.")
            .change_needs(kOpensPort)
            .word(
                "framing", [](auto& master) -> auto& { return master.access.framing; },
                kMasterFramings, "Framing of the master.")
            .initially("rtu")
            .change_needs(kOpensPort)
            .word(
                "broadcast", [](auto& master) -> auto& { return master.access.broadcast; },
                kBroadcasts,
                "Broadcasts of the master: silent sends them on, deny does not. They "
                "have no answer in either case.")
            .initially("silent")
            .word("on_failure", &Settings::on_failure, kFailures,
                  "What the master gets where a panel does not answer.")
            .word("echo", &Settings::echo, kEchoes,
                  "Whether the adapter hears what it sends; auto: found out.")
            .change_needs(kOpensPort)
            .other("response_timeout",
                   "How long the master waits: what would be sent later is not sent. "
                   "Without it no limit but the deadline.",
                   &Settings::response_timeout)
            .change_needs(kOpensPort);
    return kKeys;
}

const Keys<web::Settings>& http_keys() {
    using web::Settings;
    static const auto kKeys =
        Keys<Settings>()
            .other("listen", "ADDR:PORT or [ADDR]:PORT.", &Settings::name)
            .initially("127.0.0.1:8080")
            .change_needs(kListensAnew)
            .other("anonymous",
                   "Role without a token: none, viewer (reads), operator (reads and writes), "
                   "engineer (also raw, broadcast, discover, simulator), admin (also reload), or "
                   "one of access.roles.",
                   [](const Settings& settings) { return std::string(settings.anonymous.name()); })
            .initially("viewer")
            .other("hosts",
                   "Its names in URLs, besides its addresses and localhost; another name "
                   "is answered 421. Without it the machine's name.",
                   &Settings::hosts)
            .other("cors",
                   "Origins of other sites whose pages may read, such as "
                   "https://scada.plant.example.",
                   &Settings::cors)
            .other("allow",
                   "Networks whose clients may connect, such as 192.168.1.0/24. Without it any.",
                   &Settings::allow)
            .change_needs(kAllowCloses)
            .other("tokens", "Tokens of clients (Authorization: Bearer TOKEN).")
            .other("tls", "HTTPS: only clients that speak TLS are served.")
            .change_needs(kTlsCloses)
            .integer("max_connections_per_address", &Settings::max_connections_per_address, 1,
                     static_cast<std::int64_t>(Settings().max_connections),
                     "Most connections of one address, event streams apart; then its longest "
                     "idle one is closed.");
    return kKeys;
}

const Keys<tls::Settings>& tls_keys() {
    using tls::ClientCertificate;
    using tls::Settings;
    using tls::Version;
    static constexpr Words<ClientCertificate, 3> kClients{
        {{"none", ClientCertificate::none},
         {"optional", ClientCertificate::optional},
         {"required", ClientCertificate::required}}};
    static constexpr Words<Version, 2> kVersions{
        {{"TLSv1.2", Version::tls12}, {"TLSv1.3", Version::tls13}}};
    static constexpr Words<bool, 1> kRoles{{{"certificate", true}}};
    static const auto kKeys =
        Keys<Settings>()
            .other("certificate",
                   "PEM file of the gateway's certificate, then of those between it and its CA.",
                   &Settings::certificate)
            .change_needs(kTlsRenewed)
            .other("key", "PEM file of that certificate's key, without a password.", &Settings::key)
            .change_needs(kTlsRenewed)
            .other("ca", "PEM file of the CA that signs the certificates of clients.",
                   &Settings::ca)
            .change_needs(kTlsCloses)
            .word("client", &Settings::client, kClients,
                  "Whether clients show a certificate: none, optional, required.")
            .change_needs(kTlsCloses)
            .other("crl", "PEM file of the certificates that the CA has revoked.", &Settings::crl)
            .change_needs(kTlsCloses)
            .word("role_from", &Settings::role_from_certificate, kRoles,
                  "certificate: the role in a client's certificate decides what it may; without "
                  "one it only reads.")
            .initially("")
            .change_needs(kTlsCloses)
            .word("min_version", &Settings::lowest, kVersions,
                  "Oldest version that is spoken: TLSv1.2 or TLSv1.3.")
            .change_needs(kTlsCloses);
    return kKeys;
}

const Keys<web::Token>& token_keys() {
    static const auto kKeys =
        Keys<web::Token>()
            .other("name", "Name that is in the log; unique.", &web::Token::name)
            .other("role",
                   "viewer reads, operator writes, engineer also raw, broadcast, discover and "
                   "simulator, admin also reload; or one of access.roles.",
                   [](const web::Token& token) { return std::string(token.standing.name()); })
            .other("file",
                   "File that holds the token, or its hash as `panelgate token new` prints it, and "
                   "nothing else.",
                   &web::Token::file)
            .other("expires",
                   "Last day of the token, such as 2027-12-31, or an instant, "
                   "2027-12-31T18:00:00Z; in UTC. Without it none.",
                   [](const web::Token& token) {
                       return token.expires ? web::expiry_text(*token.expires) : std::string();
                   });
    return kKeys;
}

const Keys<points::Relay>& relay_keys() {
    using points::Relay;
    const auto text = [](const points::RelayEnd& end) { return end.station + '/' + end.at; };
    static const auto kKeys =
        Keys<Relay>()
            .other("from", "Source: STATION/NOTATION, such as press/UW100.",
                   [=](const Relay& relay) { return text(relay.from); })
            .other("to", "Target: STATION/NOTATION.",
                   [=](const Relay& relay) { return text(relay.to); })
            .integer("count", &Relay::count, 1, 2040, "Number of registers or bits.")
            .duration("every", &Relay::every, 1ms, points::kSlowest, "Interval between two reads.")
            .boolean("on_change", &Relay::on_change, "Writes only what has changed.")
            .duration("refresh", &Relay::refresh, 1s, points::kSlowest,
                      "With on_change: writes all again that often; what other clients write "
                      "there is overwritten within a second.");
    return kKeys;
}

const Keys<mqtt::Settings>& mqtt_keys() {
    using mqtt::Settings;
    static constexpr Words<mqtt::Format, 2> kFormats{
        {{"json", mqtt::Format::json}, {"sparkplug", mqtt::Format::sparkplug}}};
    static constexpr Words<bool, 2> kWrites{{{"none", false}, {"points", true}}};
    static const auto kKeys =
        Keys<Settings>()
            .other("broker", "Address: mqtt://HOST:1883, or mqtts://HOST:8883 with TLS.",
                   &Settings::broker)
            .word("format", &Settings::format, kFormats,
                  "json, or sparkplug (Sparkplug B), which has group and node in place of "
                  "the topic.")
            .other("topic", "Beginning of the topics TOPIC/STATION/POINT, of format json.",
                   &Settings::topic)
            .initially("panelgate")
            .other("group", "Group id. Without it the topic, with '-' for '/'.", &Settings::group)
            .other("node", "Edge node id. Without it the machine's name.", &Settings::node)
            .integer("qos", &Settings::qos, 0, 1,
                     "Quality of service; 0: what is on its way may be lost.")
            .other("client_id", "Client id. Without it panelgate- and the machine's name.",
                   &Settings::client_id)
            .other("username", "User at the broker. Without it none.", &Settings::username)
            .other("password_file", "File that holds the password of `username`.",
                   &Settings::password_file)
            .duration("keep_alive", &Settings::keep_alive, 5s, 1h,
                      "Keep-alive interval, in whole seconds.")
            .integer("store", &Settings::store, 100, 1'000'000,
                     "Changes that are kept while the broker is away.")
            .word("write", &Settings::write, kWrites,
                  "points: who may publish TOPIC/+/+/set, or DCMD, writes points.")
            .other("tls", "TLS at the broker, with mqtts://. Without it the system's CAs count.")
            .other("ca", "The same as in `tls`, from earlier versions.", &Settings::ca)
            .other("certificate", "The same as in `tls`, from earlier versions.",
                   &Settings::certificate)
            .other("key", "The same as in `tls`, from earlier versions.", &Settings::key);
    return kKeys;
}

const Keys<mqtt::Settings>& mqtt_tls_keys() {
    using mqtt::Settings;
    static const auto kKeys =
        Keys<Settings>()
            .other("ca",
                   "PEM file of the CA that signs the broker's certificate. Without it the "
                   "system's trusted CAs.")
            .other("certificate", "PEM file of the gateway's own certificate, with key.")
            .other("key", "PEM file of that certificate's key, with certificate.");
    return kKeys;
}

const Keys<audit::Settings>& audit_keys() {
    using audit::OnFailure;
    using audit::Settings;
    static constexpr Words<OnFailure, 2> kFailures{
        {{"continue", OnFailure::keep_on}, {"refuse_writes", OnFailure::refuse_writes}}};
    static const auto kKeys =
        Keys<Settings>()
            .other("file",
                   "File that is written; full ones beside it have a number behind the name.",
                   &Settings::file)
            .other("rotate", "Size of a file, such as 50MiB; then the next one begins.",
                   [](const Settings& settings) { return size_text(settings.rotate); })
            .initially("50MiB")
            .integer("keep", &Settings::keep, 1, 10'000, "Full files that are kept.")
            .word("on_failure", &Settings::on_failure, kFailures,
                  "What happens while the disk takes nothing: continue, which may lose records, or "
                  "refuse_writes (exception 06).")
            .boolean("syslog", &Settings::syslog,
                     "Each record goes to the machine's syslog as well (/dev/log, RFC 5424).");
    return kKeys;
}

namespace {

std::vector<access::Act> acts_of(const access::Rule& rule, bool allowed) {
    std::vector<access::Act> all;
    for (const auto act :
         {access::Act::read, access::Act::write, access::Act::broadcast, access::Act::raw})
        if (rule.allow == allowed && rule.acts.has(act)) all.push_back(act);
    return all;
}

}  // namespace

const Keys<access::Settings>& rules_keys() {
    static constexpr Words<bool, 2> kDefaults{{{"allow", true}, {"deny", false}}};
    static const auto kKeys =
        Keys<access::Settings>()
            .word("default", &access::Settings::allow_by_default, kDefaults,
                  "What is done where no rule matches: allow or deny.")
            .other("roles", "Roles besides viewer, operator, engineer and admin.")
            .other("rules", "Rules, in the order in which they are asked.");
    return kKeys;
}

const Keys<OwnRole>& own_role_keys() {
    static const auto kKeys =
        Keys<OwnRole>()
            .other("name", "Name of the role, for tokens, anonymous, certificates and rules.",
                   &OwnRole::name)
            .other("rights",
                   "What it may do: read, write, broadcast, raw, discover, simulator, reload. "
                   "A broadcast is also a write, and raw also a read or a write.",
                   [](const OwnRole& role) {
                       std::vector<Right> rights;
                       for (const Right right : kAllRights)
                           if (role.rights.has(right)) rights.push_back(right);
                       return rights;
                   });
    return kKeys;
}

const Keys<access::Rule>& rule_keys() {
    using access::Rule;
    static const auto kKeys =
        Keys<Rule>()
            .other("name", "Name of the rule, for refusals, metrics and the audit; unique.",
                   &Rule::name)
            .other("allow",
                   "What the rule allows: read, write, broadcast (also a write), raw (also a read "
                   "or a write).",
                   [](const Rule& rule) { return acts_of(rule, true); })
            .other("deny", "What it denies; a rule has allow or deny.",
                   [](const Rule& rule) { return acts_of(rule, false); })
            .other("from", "Networks of the clients that it is about. Without it any.", &Rule::from)
            .other("roles",
                   "Roles that it is about: viewer, operator, engineer, admin, one of "
                   "access.roles, or a role of a client's certificate. Modbus clients without one "
                   "are operators.",
                   &Rule::roles)
            .other("tokens", "Tokens that it is about, by name.", &Rule::tokens)
            .other("faces", "Ways in: modbus_tcp (UDP, too), http, mqtt, serial_master.",
                   &Rule::faces)
            .other("listeners", "Listeners by their address, or serial masters by name.",
                   &Rule::listeners)
            .other("stations", "Stations by name, or LINE/ID. Without it all.", &Rule::stations)
            .other("functions", "Function codes. Without it all.", &Rule::functions)
            .other("range",
                   "Items: FIRST-LAST in the panel's notation, such as UW100-UW199, "
                   "TABLE/FIRST-LAST, or a map. Functions without items are among them only where "
                   "`functions` names them.",
                   &Rule::range);
    return kKeys;
}

}  // namespace panelgate::config
