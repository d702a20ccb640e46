#pragma once

#include <string>
#include <vector>

#include "panelgate/config/config.hpp"
#include "panelgate/web/http/message.hpp"

namespace panelgate::app {

/// Something legal that is worth a word in the log.
struct Notice {
    std::string event;
    std::string text;
};
/// Fits what was read to this machine and this process (address families, descriptors), and says
/// what is worth a word: its own warnings, lines that are planned too full, what had to be lowered.
std::vector<Notice> prepare(config::Config& config);
/// As REST shows it.
web::SharedText shown_text(const config::Config& config);

}  // namespace panelgate::app
