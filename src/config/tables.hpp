#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "keys.hpp"
#include "load_stations.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/config/describe.hpp"

namespace panelgate::config {

/// A station is in two settings: what the gateway knows of it, and what its line's arbiter does.
template <class Of, class Settings>
struct StationParts {
    Of& station;
    Settings& settings;
    bool in_ascii = false;  ///< its line is
};
using StationBody = StationParts<Station, arbiter::StationSettings>;
using StationView = StationParts<const Station, const arbiter::StationSettings>;

inline constexpr Words<EchoMode, 3> kEchoes{
    {{"auto", EchoMode::automatic}, {"on", EchoMode::on}, {"off", EchoMode::off}}};
inline constexpr Words<modbus::HexDigits, 2> kLowerCase{
    {{"refuse", modbus::HexDigits::upper_only}, {"take", modbus::HexDigits::any_case}}};

inline std::string access_text(bool read_only) { return read_only ? "read_only" : "read_write"; }

// The keys of the configuration: a table a map, in the order in which they are described. Keys that
// hold a map or a list are rows, too; their own keys have a table of their own.

const Keys<Config>& root_keys();
const Keys<rt::LogSettings>& log_keys();
const Keys<rt::RealtimeSettings>& realtime_keys();

const Keys<Line>& line_keys();
const Keys<line::Settings>& port_keys();
const Keys<SerialFormat>& serial_keys();
const Keys<line::Rs485>& rs485_keys();
/// Of lines and stations.
const Keys<Timing>& timing_keys();
/// A pause inside frames and a rest, which only lines have.
const Keys<Line>& line_timing_keys();
/// The protocol, which a serial master has elsewhere.
const Keys<Line>& line_serial_keys();
const Keys<Line>& line_fault_keys();
const Keys<arbiter::QueueSettings>& queue_keys();
const Keys<arbiter::OfflineSettings>& offline_keys();

const Keys<StationBody, StationView>& station_keys();
const Keys<sim::Misbehaviour>& fault_keys();
const Keys<points::Poll>& poll_keys();
const Keys<points::Point>& point_keys();

/// Of listeners and serial masters.
const Keys<tcp_server::Settings>& access_keys();
const Keys<tcp_server::Settings>& listener_keys();
const Keys<serial_server::Settings>& master_keys();
const Keys<web::Settings>& http_keys();
/// Of listeners and http.
const Keys<tls::Settings>& tls_keys();
const Keys<web::Token>& token_keys();
const Keys<points::Relay>& relay_keys();
const Keys<mqtt::Settings>& mqtt_keys();
/// Of `tls` of mqtt.
const Keys<mqtt::Settings>& mqtt_tls_keys();
const Keys<audit::Settings>& audit_keys();
/// "50MiB", as in the file.
std::string size_text(std::size_t bytes);

/// Of the top-level `access`.
const Keys<access::Settings>& rules_keys();
const Keys<access::Rule>& rule_keys();
const Keys<OwnRole>& own_role_keys();

}  // namespace panelgate::config
