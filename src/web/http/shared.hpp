#pragma once

#include <functional>
#include <memory>
#include <utility>

#include "admission.hpp"
#include "origin.hpp"
#include "panelgate/rt/process.hpp"
#include "panelgate/web/http/counters.hpp"
#include "panelgate/web/http/message.hpp"

namespace panelgate::web {

/// State shared by the sessions of one listener. Single-threaded.
struct Shared {
    explicit Shared(std::shared_ptr<const Site> with_site)
        : site(std::move(with_site)),
          hosts(site->settings, machine_names()),
          wrong_tokens(site->settings.wrong_tokens),
          places(site->settings) {}

    /// Replaces the site; running requests keep the previous one alive.
    void serve(std::shared_ptr<const Site> other) {
        site = std::move(other);
        hosts = HostNames(site->settings, machine_names());
        wrong_tokens.apply(site->settings.wrong_tokens);
        places.apply(site->settings);
    }

    std::shared_ptr<const Site> site;
    HostNames hosts;
    WrongTokens wrong_tokens;
    Places places;
    Counters counters;
    std::size_t sending = 0;             ///< bytes of long bodies being sent
    std::function<Counters()> figures;   ///< the listener's, set by it
    std::unique_ptr<rt::Worker> worker;  ///< makes long texts; null: none was asked for
};

}  // namespace panelgate::web
