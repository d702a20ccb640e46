#pragma once

#include <functional>
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

/// Returns the faults of a configuration; config::load() is not for this module.
using Check = std::function<std::vector<yaml::Problem>(const std::string& yaml)>;

/// Reads the tags of Kepware's CSV, of Telegraf's [[inputs.modbus]] or of Home Assistant's
/// `modbus:`. Nothing for a text of neither program; nothing, and problems, for one with faults or
/// without a tag that can be taken. `is_known` becomes true for a text of one of them. What `check`
/// refuses is left out of the configuration and becomes a note.
std::optional<Imported> import_tags(std::string_view text, yaml::Problems& problems, bool& is_known,
                                    const Check& check = {});

}  // namespace panelgate::imports
