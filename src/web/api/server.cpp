#include "panelgate/web/api/server.hpp"

#include <utility>

#include "http/listener.hpp"

namespace panelgate::web {

Server::Server(boost::asio::any_io_executor executor, Settings settings, const Directory& directory,
               Providers providers) {
    auto api = std::make_shared<Api>();
    api->settings = std::move(settings);
    api->directory = &directory;
    api->providers = std::move(providers);
    listener_ = std::make_shared<Listener>(std::move(executor), std::move(api));
}

Server::~Server() { listener_->abandon(); }

boost::system::error_code Server::start() { return listener_->open(); }

std::uint16_t Server::port() const { return listener_->port(); }

void Server::stop() { listener_->stop(); }

std::size_t Server::connections() const { return listener_->connections(); }

}  // namespace panelgate::web
