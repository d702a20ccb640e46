#pragma once

#include "http_types.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/profile/panel_profile.hpp"

namespace panelgate::web {

/// What a client is told of its write.
HttpResponse write_answer(const bus::Answer& answer, const profile::PanelProfile& profile);

}  // namespace panelgate::web
