#include "panelgate/web/api/server.hpp"

#include <utility>

#include "key_book.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/tls/context.hpp"
#include "panelgate/web/http/listener.hpp"
#include "panelgate/web/http/message.hpp"
#include "routes.hpp"

namespace panelgate::web {

Server::Server(boost::asio::any_io_executor executor, Settings settings,
               std::shared_ptr<const Directory> directory, Providers providers, Surface surface)
    : providers_(std::move(providers)),
      surface_(surface),
      keys_(std::make_shared<KeyBook>(providers_.settings)),
      listener_(std::make_shared<HttpListener>(
          std::move(executor), site_of(std::move(settings), std::move(directory)))) {}

std::shared_ptr<const Site> Server::site_of(Settings settings,
                                            std::shared_ptr<const Directory> directory) const {
    auto api = std::make_shared<Api>();
    *current_ = directory;
    api->current = current_;
    api->directory = directory.get();
    api->keeps = std::move(directory);
    api->providers = providers_;
    api->keys = keys_;
    api->configuration = std::make_shared<std::map<std::string, std::shared_ptr<KeptAnswer>>>();
    auto site = std::make_shared<Site>();
    site->settings = std::move(settings);
    site->product = "panelgate/" + providers_.version;
    site->now = providers_.now;
    site->record = providers_.record;
    site->wall = providers_.wall;
    site->routes =
        surface_ == Surface::gateway ? routes(std::move(api)) : simulator_routes(std::move(api));
    site->next_caller = bus::next_client_id;
    return site;
}

void Server::apply(Settings settings, std::shared_ptr<const Directory> directory,
                   SharedText configuration) {
    providers_.configuration = std::move(configuration);
    listener_->apply(site_of(std::move(settings), std::move(directory)));
}

Server::~Server() {
    keys_->dismiss();
    listener_->abandon();
}

boost::system::error_code Server::start() { return listener_->open(); }

std::uint16_t Server::port() const { return listener_->port(); }

void Server::stop(Duration reading) { listener_->stop(reading); }

void Server::renew(const tls::Settings& settings) { listener_->renew(settings); }

Counters Server::counters() const { return listener_->counters(); }

std::size_t Server::connections() const { return listener_->connections(); }

}  // namespace panelgate::web
