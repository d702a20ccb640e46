#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/access/line_rules.hpp"
#include "panelgate/access/settings.hpp"
#include "panelgate/alarms/settings.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/audit/settings.hpp"
#include "panelgate/images/layout.hpp"
#include "panelgate/images/settings.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/mqtt/settings.hpp"
#include "panelgate/points/settings.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/profile/panel_profile.hpp"
#include "panelgate/rt/settings.hpp"
#include "panelgate/serial_server/settings.hpp"
#include "panelgate/sim/settings.hpp"
#include "panelgate/standby/settings.hpp"
#include "panelgate/store/settings.hpp"
#include "panelgate/tcp_server/settings.hpp"
#include "panelgate/web/http/settings.hpp"
#include "panelgate/yaml/document.hpp"
#include "panelgate/yaml/variables.hpp"

namespace panelgate::config {

/// Limits for what templates add to all stations together: a short file must not use much memory.
inline constexpr std::size_t kMaxTemplateValues = 500'000;
inline constexpr std::size_t kMaxTemplateText = 16 * 1024 * 1024;  ///< bytes of keys and scalars

/// Shorter tokens cause a warning: 16 hexadecimal digits are 64 bits.
inline constexpr std::size_t kShortToken = 16;

struct Station {
    std::uint8_t id = 1;
    std::string name;             ///< unique over all lines; "LINE-ID" if the file has none
    profile::ProfileRef profile;  ///< never null
    bool read_only = false;
    bool listens = false;  ///< the gateway only listens on its line
    bool guard = false;  ///< requests that the profile rules out are refused without using the bus
    Duration think_time = 1ms;  ///< what a plan assumes of its panel; not waited for
    bool automatic_gap = true;  ///< `frame_gap` is not set, so it depends on the baud rate
    bool translate = true;      ///< functions that its panel lacks are sent as equivalent ones
    sim::Misbehaviour faults;   ///< faults of the simulated panel
    std::vector<points::Point> points;  ///< of the file itself, then of `points_file`
    std::string points_file;            ///< path; "": none
    std::vector<points::Poll> polls;
    friend bool operator==(const Station&, const Station&) = default;
};

/// The rules of `access` for one line.
struct LineAccess {
    std::shared_ptr<const access::LineRules> rules;  ///< null before loading has ended
    friend bool operator==(const LineAccess& one, const LineAccess& other) {
        if (!one.rules || !other.rules) return one.rules == other.rules;
        return one.rules->says_the_same(*other.rules);
    }
};

struct Line {
    enum class Kind : std::uint8_t { serial, tcp, simulated };
    std::string name;
    Kind kind = Kind::serial;
    line::Settings device;
    std::string second{};       ///< device that is used while the first cannot be opened; "": none
    arbiter::Settings arbiter;  ///< with the resolved timing of every station
    bool listens = false;       ///< another master polls it: the gateway never sends
    bool standby = false;       ///< ... and that is the other box; never of a file
    bool refuse_unlisted = false;
    Duration think_time = 1ms;    ///< of stations without their own
    bool automatic_gap = true;    ///< `frame_gap` is not set, or auto
    bool simulated_echo = false;  ///< the simulated adapter echoes what is sent
    std::vector<Station> stations;
    LineAccess access;
    friend bool operator==(const Line&, const Line&) = default;
};

/// The line with its second device in place of the first.
Line by_second(Line line);

/// A valid configuration (docs/reference/configuration.md): defaults filled in, references
/// resolved.
struct Config {
    std::shared_ptr<const profile::Catalogue> profiles;
    std::string profiles_dir;  ///< of those that are not shipped; "" none
    std::vector<Line> lines;
    std::vector<points::Relay> relays;
    std::vector<tcp_server::Settings> modbus_tcp;
    std::vector<serial_server::Settings> serial_masters;
    std::optional<web::Settings> http;
    std::optional<mqtt::Settings> mqtt;  ///< empty: values go to no broker
    access::Settings access;             ///< who may do what
    rt::LogSettings log;
    rt::RealtimeSettings realtime;
    std::optional<audit::Settings> audit{};  ///< empty: nothing is recorded
    std::vector<alarms::Settings> alarms{};
    std::optional<alarms::WebhookSettings> webhook{};  ///< of alarms
    store::Settings store{};                           ///< events and history
    std::optional<standby::Settings> standby{};        ///< empty: there is no other box
    std::vector<images::Settings> images{};
    /// Where each line's name stands, by that name.
    std::map<std::string, yaml::Mark> line_marks;
    /// Warnings of legal but questionable settings ("8N1 is outside the standard"), as
    /// FILE:LINE:COLUMN text.
    std::vector<std::string> warnings;
};

/// Gives stations of `next` the running configuration's profile object if it is equal.
void share_profiles(Config& next, const Config& running);

/// Null: there is none.
const Station* station_named(const Config& config, std::string_view name);
const points::Point* point_named(const Config& config, std::string_view station,
                                 std::string_view point);
/// The map of one of the configuration's images; the configuration outlives it.
images::Layout layout_of(const images::Settings& image, const Config& config);
/// The names of the lines whose points the image shows.
std::vector<std::string> lines_of(const images::Settings& image, const Config& config);

/// Access to files, for profiles_dir and token files. read() returns a file's content; nothing if
/// it cannot be read.
struct Files {
    virtual ~Files() = default;
    virtual std::optional<std::string> read(const std::string& path) const = 0;
    /// Paths of the *.yaml files in a directory, sorted; nothing if it cannot be listed.
    virtual std::optional<std::vector<std::string>> list_yaml(const std::string& dir) const = 0;
    /// True if all users of the machine can read the file; false for secrets that a container
    /// platform mounts read-only for one container.
    virtual bool is_readable_by_all(const std::string&) const { return false; }
    /// True if the path is a pipe, a socket or a device, whose reading might never end.
    virtual bool is_special(const std::string&) const { return false; }
    /// The path without symbolic links, such as /dev/ttyUSB0 for /dev/serial/by-id/...; the path
    /// itself where no such file exists.
    virtual std::string real_path(const std::string& path) const { return path; }
};

/// Parses and checks a configuration. Returns nothing if it adds anything to `problems`.
/// `environment` gives the values of ${NAME}. Relative file names in the text are beside the
/// file of `problems` (beside()).
std::optional<Config> load(std::string_view text, const Files& files, yaml::Problems& problems,
                           const yaml::Environment& environment = {});

}  // namespace panelgate::config
