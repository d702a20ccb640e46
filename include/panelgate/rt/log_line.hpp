#pragma once

#include <string>
#include <string_view>
#include <utility>

namespace panelgate::rt {

using LogField = std::pair<std::string_view, std::string>;

/// An event in words, without its time.
struct LogLine {
    std::string text;
    std::string fields{};  ///< the same for the journal (journal.hpp); empty where it is not asked
};

}  // namespace panelgate::rt
