#pragma once

#include <string>

#include "client_names.hpp"
#include "panelgate/arbiter/actions.hpp"
#include "panelgate/arbiter/settings.hpp"

namespace panelgate::bus {

/// The arbiter's reasons and decisions in words, one line each. `client`: the name of who has
/// asked.

/// "" for a frame that has no reason.
std::string text_of(const arbiter::Reason& reason, const ClientName& client);
std::string text_of(const arbiter::Decision& decision, const ClientName& client,
                    const arbiter::QueueSettings& queue);

}  // namespace panelgate::bus
