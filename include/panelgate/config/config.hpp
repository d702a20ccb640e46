#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/arbiter/settings.hpp"
#include "panelgate/line/settings.hpp"
#include "panelgate/mqtt/settings.hpp"
#include "panelgate/points/settings.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/profile/panel_profile.hpp"
#include "panelgate/rt/settings.hpp"
#include "panelgate/serial_server/settings.hpp"
#include "panelgate/sim/settings.hpp"
#include "panelgate/tcp_server/settings.hpp"
#include "panelgate/web/http/settings.hpp"
#include "panelgate/yaml/document.hpp"
#include "panelgate/yaml/variables.hpp"

namespace panelgate::config {

struct Station {
    std::uint8_t id = 1;
    std::string name;  ///< unique over all lines; "LINE-ID" is given when the file has none
    profile::ProfileRef profile;  ///< never null
    bool read_only = false;
    bool listens = false;       ///< its line is only listened to
    bool guard = false;         ///< what the profile rules out is refused without using the bus
    Duration think_time = 1ms;  ///< what a plan assumes of its panel; nothing waits for it
    bool automatic_gap = true;  ///< its `frame_gap` is not set and would follow another rate
    bool translate = true;      ///< what its panel lacks goes out as what does the same
    sim::Misbehaviour faults;   ///< of the simulated panel
    std::vector<points::Point> points;
    std::vector<points::Poll> polls;
    friend bool operator==(const Station&, const Station&) = default;
};

struct Line {
    enum class Kind : std::uint8_t { serial, tcp, simulated };
    std::string name;
    Kind kind = Kind::serial;
    line::Settings device;
    arbiter::Settings arbiter;  ///< every station's timing resolved
    bool listens = false;       ///< its master is somebody else: nothing is ever sent
    bool refuse_unlisted = false;
    bool simulated_echo = false;  ///< the simulated adapter hears itself
    std::vector<Station> stations;
    friend bool operator==(const Line&, const Line&) = default;
};

/// A valid configuration (README, Configuration): defaults filled in, references resolved.
struct Config {
    std::shared_ptr<const profile::Catalogue> profiles;
    std::vector<Line> lines;
    std::vector<points::Relay> relays;
    std::vector<tcp_server::Settings> modbus_tcp;
    std::vector<serial_server::Settings> serial_masters;
    std::optional<web::Settings> http;
    std::optional<mqtt::Settings> mqtt;  ///< nothing: values go to no broker
    rt::LogSettings log;
    rt::RealtimeSettings realtime;
    /// Things that are legal but worth a word ("8N1 is outside the standard"), FILE:LINE:COLUMN
    /// text.
    std::vector<std::string> warnings;
};

/// Stations of `next` whose panel the one that runs describes alike are given that one's profile:
/// what compares equal then is the same.
void share_profiles(Config& next, const Config& running);

/// Reads a file's content; nothing when it cannot be read. For profiles_dir and token files.
struct Files {
    virtual ~Files() = default;
    virtual std::optional<std::string> read(const std::string& path) const = 0;
    /// Paths of the *.yaml files in a directory, sorted; nothing when it cannot be listed.
    virtual std::optional<std::vector<std::string>> list_yaml(const std::string& dir) const = 0;
    /// By everybody on the machine, though nobody has set it up for programs alone: container
    /// platforms mount secrets read-only and readable, for one container.
    virtual bool is_readable_by_all(const std::string&) const { return false; }
    /// There, and a pipe, a socket or a device: to read it might never end.
    virtual bool is_special(const std::string&) const { return false; }
};

/// Text -> Config. Nothing is returned when `problems` got any entry. `environment` gives the
/// values of ${NAME}; files that are named in the text are taken as they are.
std::optional<Config> load(std::string_view text, const Files& files, yaml::Problems& problems,
                           const yaml::Environment& environment = {});

}  // namespace panelgate::config
