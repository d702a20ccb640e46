#pragma once

#include <memory>
#include <utility>

#include "admission.hpp"
#include "origin.hpp"
#include "panelgate/web/http/counters.hpp"
#include "panelgate/web/http/message.hpp"

namespace panelgate::web {

/// What the sessions of one listener have in common. One thread.
struct Shared {
    explicit Shared(std::shared_ptr<const Site> with_site)
        : site(std::move(with_site)),
          hosts(site->settings, machine_names()),
          logins(site->settings.logins),
          places(site->settings),
          ration(site->settings.ration) {}

    /// Another one from now on; who works on the one before holds it.
    void serve(std::shared_ptr<const Site> other) {
        site = std::move(other);
        hosts = HostNames(site->settings, machine_names());
        logins.apply(site->settings.logins);
        places.apply(site->settings);
        ration.apply(site->settings.ration);
    }

    std::shared_ptr<const Site> site;
    HostNames hosts;
    Logins logins;
    Places places;
    Ration ration;
    Counters counters;
};

}  // namespace panelgate::web
