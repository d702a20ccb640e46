#pragma once

#include "keys.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/profile/notation.hpp"

namespace panelgate::config {

/// A station has two settings: the gateway's description of the panel, and the settings of the
/// line's arbiter.
template <class Of, class Settings>
struct StationParts {
    Of& station;
    Settings& settings;
    bool in_ascii = false;  ///< its line is
};
using StationBody = StationParts<Station, arbiter::StationSettings>;
using StationView = StationParts<const Station, const arbiter::StationSettings>;

/// Timing as written; empty frame_gap = auto.
struct Timing {
    arbiter::StationSettings settings;
    std::optional<Duration> frame_gap;
    Duration think_time = 1ms;
    std::optional<Duration> ceiling{};         ///< of an adaptive timeout
    std::optional<yaml::Mark> unused_bound{};  ///< of an adaptive timeout, where there is none
};
/// As written: what was reckoned is `auto`.
Timing written(const arbiter::StationSettings& settings, bool automatic_gap, Duration think_time);

/// A line while its keys are read.
struct LineContext {
    Line& line;
    /// False: the line's serial format had a fault, so no timing is checked against the format.
    bool serial_known = true;
    Timing timing{};
};

inline constexpr Words<EchoMode, 3> kEchoes{
    {{"auto", EchoMode::automatic}, {"on", EchoMode::on}, {"off", EchoMode::off}}};
inline constexpr Words<modbus::HexDigits, 2> kLowerCase{
    {{"refuse", modbus::HexDigits::upper_only}, {"take", modbus::HexDigits::any_case}}};
inline constexpr Words<bool, 2> kAccess{{{"read_write", false}, {"read_only", true}}};
/// A text that is a name.
const Form& name_form();

// The rows of each map that another file's table names.

const Keys<Config>& root_keys();
const Keys<Line>& line_keys();
/// Of lines and stations.
const Keys<Timing>& timing_keys();
/// Of lines: also what all stations share.
const Keys<LineContext, Line>& line_timing_keys();
const Keys<StationBody, StationView>& station_keys();
const Keys<points::Poll>& poll_keys();
const Keys<points::Point>& point_keys();
const Keys<SerialFormat>& serial_keys();
const Keys<line::Rs485>& rs485_keys();
inline constexpr std::string_view kRs485 = "Direction control of an RS-485 transceiver.";
/// Of a serial port that is not a line.
const Keys<line::Settings>& port_keys();
const Keys<tcp_server::Settings>& listener_keys();
const Keys<serial_server::Settings>& master_keys();
const Keys<web::Settings>& http_keys();
const Keys<tls::Settings>& tls_keys();
const Keys<points::Relay>& relay_keys();
const Keys<mqtt::Settings>& mqtt_keys();
const Keys<audit::Settings>& audit_keys();
const Keys<store::Settings>& store_keys();
const Keys<alarms::Settings>& alarm_keys();
const Keys<alarms::WebhookSettings>& webhook_keys();
const Keys<images::Settings>& image_keys();
const Keys<standby::Settings>& standby_keys();
void check_standby(Reader& in, standby::Settings& settings);
const Keys<points::ReportRule>& report_keys();
void check_report(Reader& in, points::Point& point);
void check_webhook(Reader& in, alarms::WebhookSettings& hook);
const Keys<access::Settings>& access_keys();

// What reads an entry of a list.

std::optional<Line> load_line(Reader& root, const yaml::Node& node);
/// Reads a line's station, and its settings into those of the line's arbiter.
void load_station(Reader& owner, const yaml::Node& node, Line& line);
std::optional<points::Poll> load_poll(Reader& owner, const yaml::Node& node);
bool read_points_file(Reader& in, Station& station);
std::optional<points::Point> load_point(Reader& owner, const yaml::Node& node);
std::optional<tcp_server::Settings> load_listener(Reader& root, const yaml::Node& node);
/// The keys that say which panels a client reaches; its units are from `first` to `last`.
Keys<tcp_server::Settings> make_reach_keys(std::int64_t first, std::int64_t last);
/// `units` must distinguish a station id that is on two lines of one listener.
void check_overlap(Reader& in, const tcp_server::Settings& settings);
std::optional<serial_server::Settings> load_master(Reader& root, const yaml::Node& node);
std::optional<alarms::Settings> load_alarm(Reader& root, const yaml::Node& node);
std::optional<images::Settings> load_image(Reader& root, const yaml::Node& node);
/// Reads the relays, which must not overlap or form a circle.
bool load_relays(Reader& root, Config& config);
/// Reads `access.roles`, which other maps name.
void load_own_roles(Loading& loading, const yaml::Node& tree);
/// Gives each line its rules.
void apply_rules(Config& config);

// What two keys say together

/// Reads a line's `timing`, with the line's own keys.
bool load_line_timing(Reader& in, LineContext& work);
/// Reads a station's `timing`, merged over its line's; resolves the frame gap with its profile and
/// sets the station's think time.
arbiter::StationSettings load_station_timing(Reader& in, const LineContext& work, Station& station);
/// Warns of what a line's stations say together.
void warn_of_stations(Reader& in, const LineContext& work);
/// Warns of what cannot end before the queue's deadline, once for each cause: a response timeout,
/// or a read on this wire. `node` is the whole line's.
void warn_of_deadline(Loading& loading, const yaml::Node& node, const Line& line);
/// Warns at `device` if `device` and `other`, the device of `owner`, are two names of one adapter:
/// only one owner can open an adapter (solax-modbus#1171).
void warn_of_same_adapter(Reader& in, const std::string& device, const std::string& owner,
                          const std::string& other);
/// Warns of a key that only a sending gateway uses, on a line that is only listened to.
void warn_of_unused_key(Reader& in, std::string_view key);
/// Checks an unused template as a station's body, so that faults of the template are found before
/// use. A template without a profile is checked with the best fitting profile.
void check_template(Loading& loading, const yaml::Node& body);
/// Reads the key `serial` of a line or of another port by `read`. False if there was a fault: the
/// format must not be used.
bool read_serial(Reader& owner, const std::function<void(Reader&)>& read);
void check_rs485(Reader& in, const line::Rs485& rs485);
/// Refuses /dev/ttyUSB0:9600 and the like; other paths may contain colons.
void check_path(Reader& in, const std::string& path);
/// Finds a station by its name; null, and a problem at `key`, if there is none.
const Station* find_station(Reader& in, std::string_view key, const std::string& name);
/// STATION/POINT
struct PointPath {
    std::string station;
    std::string point;
};
/// Returns nothing for a text of another form.
std::optional<PointPath> parse_point_path(const std::string& text);
/// Finds a point; null, and a problem at `mark`, if there is none.
const points::Point* find_point(Loading& loading, yaml::Mark mark, const PointPath& path);
/// Finds an item by its notation; nothing, and a problem at `key`, if the panel has none.
std::optional<profile::Item> find_item(Reader& in, std::string_view key, const std::string& text,
                                       const profile::PanelProfile& profile);
/// Reads an item's notation, and finds its place in the panel's memory.
bool read_place(Reader& in, std::string_view key, std::string& text, modbus::Table& table,
                std::uint16_t& address);
/// Adds a problem at `key` if the panel does not return this many items in one read.
void check_read_count(Reader& in, std::string_view key, const profile::PanelProfile& profile,
                      modbus::Table table, std::uint32_t count);

/// Reads `range` of a rule: what it names at each station that the rule is about.
bool read_range(Reader& in, access::Rule& rule);
/// The rows of `range` as a map.
const Table& table_range_table();
/// Warns of rules that never decide anything.
void warn_of_rules(Loading& loading);
std::vector<std::string_view> role_words(const Config& config);
/// Returns the standing that the role's name in `text` has; reports an unknown role and returns
/// nothing.
std::optional<Standing> find_role(Reader& in, std::string_view key, const std::string& text);

/// The key `tls` of a listener: its files are read, and files that cannot serve are problems.
bool load_tls(Reader& in, std::optional<tls::Settings>& settings);
void show_tls(const SettingWriter& out, const std::optional<tls::Settings>& settings);
KeyShape tls_shape(std::string_view text);
/// Reads the path of a PEM file, and its content.
std::function<bool(Reader&, tls::Settings&)> pem_file(std::string_view key,
                                                      std::string tls::Settings::* path,
                                                      std::string tls::Material::* content);
/// Of a device on Ethernet.
const Keys<tls::Settings>& device_tls_keys();
bool load_device_tls(Reader& in, Line& line);
void show_device_tls(const SettingWriter& out, const Line& line);
/// Of Modbus/TCP Security, where a listener with `tls` names no port.
inline constexpr std::uint16_t kSecurePort = 802;

/// Reports every key and value with a line end or another control character, from an escape
/// ("\\u0007") or a variable: names and labels go into logs, metrics and pages, and no
/// configuration needs one.
void refuse_control_characters(const yaml::Node& tree, yaml::Problems& problems);

/// Warns about listeners in what was loaded from `tree` without a problem: writable from outside
/// (is_reachable_from_outside()), sharing a port, units that hide the stations with these ids,
/// tokens that others can read or guess, UDP open to the outside, and what anonymous clients from
/// there may see.
void warn_of_listeners(Loading& loading, const yaml::Node& tree);

}  // namespace panelgate::config
