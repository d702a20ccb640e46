#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/yaml/document.hpp"

namespace panelgate::imports {

/// Another program's list of tags as a configuration.
struct Imported {
    std::string yaml;                ///< for config::load(); its comments repeat the notes
    std::vector<std::string> notes;  ///< "FILE:LINE: ..." of each thing that was not taken over
};

/// Reads the tags of Kepware's CSV, of Telegraf's [[inputs.modbus]] or of Home Assistant's
/// `modbus:`. Nothing for a text of neither program; nothing, and problems, for one with faults.
/// `is_known` becomes true for a text of one of them.
std::optional<Imported> import_tags(std::string_view text, yaml::Problems& problems,
                                    bool& is_known);

}  // namespace panelgate::imports
