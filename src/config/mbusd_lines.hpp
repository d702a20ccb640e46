#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "panelgate/yaml/document.hpp"

namespace panelgate::config {

/// One NAME = VALUE of an mbusd.conf.
struct MbusdLine {
    std::string name;
    std::string value;
    yaml::Mark mark;        ///< of the name
    yaml::Mark value_mark;  ///< or of the end of the line
};

/// A line that begins with '#' is a comment, as is nothing else: what stands behind a value is part
/// of it. A line ends with LF, CR or both; a byte order mark before the first is skipped. Lines
/// that are none are added to `problems`.
std::vector<MbusdLine> mbusd_lines(std::string_view text, yaml::Problems& problems);

}  // namespace panelgate::config
