#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/yaml/document.hpp"

namespace panelgate::mbusd {

/// An mbusd configuration (0.5.3, its conf/mbusd.conf.example and cfg.c) in this program's terms.
struct Imported {
    std::string yaml;  ///< for config::load(); its comments list what is not taken over unchanged
    /// The same as one sentence each: "FILE:LINE: pause = 100: ...".
    std::vector<std::string> notes;
};

/// Converts an mbusd configuration, or a command that starts mbusd with options (of a shell, or of
/// systemd's ExecStart=). Returns nothing if it adds anything to `problems`: lines other than
/// NAME = VALUE, unknown names, values that mbusd would reject too, a file of another program,
/// which is named. Missing settings get mbusd's defaults.
std::optional<Imported> import_conf(std::string_view text, yaml::Problems& problems);

}  // namespace panelgate::mbusd
