#pragma once

#include <memory>
#include <utility>

#include "host_names.hpp"
#include "logins.hpp"
#include "panelgate/web/http/counters.hpp"
#include "panelgate/web/http/site.hpp"
#include "places.hpp"

namespace panelgate::web {

/// What the sessions of one listener have in common. One thread.
struct Shared {
    explicit Shared(std::shared_ptr<const Site> with_site)
        : site(std::move(with_site)),
          hosts(site->settings, machine_names()),
          logins(site->settings.logins),
          places(site->settings) {}

    const std::shared_ptr<const Site> site;
    const HostNames hosts;
    Logins logins;
    Places places;
    Counters counters;
};

}  // namespace panelgate::web
