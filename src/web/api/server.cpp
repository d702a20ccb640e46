#include "panelgate/web/api/server.hpp"

#include <utility>

#include "once.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/tls/context.hpp"
#include "panelgate/web/http/listener.hpp"
#include "panelgate/web/http/message.hpp"
#include "routes.hpp"

namespace panelgate::web {

Server::Server(Loops loops, Settings settings, std::shared_ptr<const Directory> directory,
               Providers providers, Surface surface)
    : crossing_(std::make_shared<Crossing>(std::move(loops))),
      providers_(std::move(providers)),
      surface_(surface),
      keys_(std::make_shared<KeyBook>(providers_.settings)),
      current_(std::make_shared<Current>(crossing_->lend(directory))),
      listener_(std::make_shared<HttpListener>(
          crossing_->loops().faces, site_of(std::move(settings), std::move(directory)))) {}

std::shared_ptr<const Site> Server::site_of(Settings settings,
                                            std::shared_ptr<const Directory> directory) const {
    auto api = std::make_shared<Api>();
    api->current = current_;
    api->directory = directory.get();
    api->lent = crossing_->lend(directory);
    api->keeps = std::move(directory);
    api->providers = providers_;
    api->keys = keys_;
    api->configuration = std::make_shared<std::map<std::string, std::shared_ptr<KeptAnswer>>>();
    auto site = std::make_shared<Site>();
    site->settings = std::move(settings);
    site->crossing = crossing_;
    site->keep_figures = [figures = figures_](const Counters& now) { *figures = now; };
    site->collect = providers_.collect;
    site->product = "panelgate/" + providers_.version;
    site->now = providers_.now;
    site->record = providers_.record;
    site->wall = providers_.wall;
    const auto lent = crossing_->lend(std::shared_ptr<const Api>(std::move(api)));
    site->routes = surface_ == Surface::gateway ? routes(lent) : simulator_routes(lent);
    site->next_caller = bus::next_client_id;
    return site;
}

void Server::apply(Settings settings, std::shared_ptr<const Directory> directory,
                   std::function<std::string()> configuration) {
    providers_.configuration = std::move(configuration);
    crossing_->run([current = current_, lent = crossing_->lend(directory), listener = listener_,
                    site = site_of(std::move(settings), directory)] {
        *current = lent;
        listener->apply(site);
    });
}

Server::~Server() {
    keys_->dismiss();
    crossing_->close();
    crossing_->call([this] {
        listener_->abandon();
        listener_.reset();
    });
}

boost::system::error_code Server::start() {
    boost::system::error_code error;
    crossing_->call([this, &error] {
        error = listener_->open();
        port_ = listener_->port();
    });
    return error;
}

void Server::stop(Duration reading) {
    crossing_->run([listener = listener_, reading] { listener->stop(reading); });
}

void Server::renew(const tls::Settings& settings) {
    crossing_->run([listener = listener_, settings] { listener->renew(settings); });
}

void Server::review() {
    crossing_->run([listener = listener_] { listener->review(); });
}

Counters Server::counters() const {
    return crossing_->is_one_loop() ? listener_->counters() : *figures_;
}

std::size_t Server::connections() const { return listener_->connections(); }

}  // namespace panelgate::web
