#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/yaml/document.hpp"

namespace panelgate::config {

/// What a configuration of mbusd (0.5.3, its conf/mbusd.conf.example and cfg.c) means here.
struct Imported {
    std::string yaml;  ///< load() takes it; its comments say what is not taken over as it is
    /// The same, a sentence each: "FILE:LINE: pause = 100: ...".
    std::vector<std::string> notes;
};

/// Nothing is returned when `problems` got any entry: lines that are no NAME = VALUE, unknown
/// names, values that mbusd would not take either. What a file leaves out has mbusd's defaults.
std::optional<Imported> import_mbusd(std::string_view text, yaml::Problems& problems);

}  // namespace panelgate::config
