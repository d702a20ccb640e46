#include "panelgate/web/api/server.hpp"

#include <utility>

#include "key_book.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/web/http/listener.hpp"
#include "panelgate/web/http/site.hpp"
#include "routes.hpp"

namespace panelgate::web {

Server::Server(boost::asio::any_io_executor executor, Settings settings, const Directory& directory,
               Providers providers, Surface surface) {
    auto api = std::make_shared<Api>();
    api->directory = &directory;
    api->providers = std::move(providers);
    keys_ = std::make_shared<KeyBook>(api->providers.settings);
    api->keys = keys_;
    auto site = std::make_shared<Site>();
    site->settings = std::move(settings);
    site->product = "panelgate/" + api->providers.version;
    site->now = api->providers.now;
    site->routes =
        surface == Surface::gateway ? routes(std::move(api)) : simulator_routes(std::move(api));
    site->next_caller = bus::next_client_id;
    listener_ = std::make_shared<HttpListener>(std::move(executor), std::move(site));
}

Server::~Server() {
    keys_->dismiss();
    listener_->abandon();
}

boost::system::error_code Server::start() { return listener_->open(); }

std::uint16_t Server::port() const { return listener_->port(); }

void Server::stop(Duration reading) { listener_->stop(reading); }

const Counters& Server::counters() const { return listener_->counters(); }

std::size_t Server::connections() const { return listener_->connections(); }

}  // namespace panelgate::web
