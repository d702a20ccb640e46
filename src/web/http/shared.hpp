#pragma once

#include <memory>
#include <utility>

#include "host_names.hpp"
#include "panelgate/web/http/site.hpp"
#include "places.hpp"

namespace panelgate::web {

/// What the sessions of one listener have in common. One thread.
struct Shared {
    explicit Shared(std::shared_ptr<const Site> with_site)
        : site(std::move(with_site)),
          hosts(site->settings, machine_names()),
          places(site->settings) {}

    const std::shared_ptr<const Site> site;
    const HostNames hosts;
    Places places;
};

}  // namespace panelgate::web
