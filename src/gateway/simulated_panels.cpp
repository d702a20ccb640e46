#include "panelgate/gateway/simulated_panels.hpp"

#include <fcntl.h>
#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/write.hpp>
#include <cerrno>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>

#include "panelgate/base/network.hpp"
#include "panelgate/gateway/build_info.hpp"
#include "panelgate/gateway/running_line.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::gateway {

namespace fs = std::filesystem;

PtyLink::PtyLink(std::string link, const std::string& target)
    : link_(std::move(link)), target_(target) {
    std::error_code error;
    const fs::file_status status = fs::symlink_status(link_, error);
    if (fs::exists(status) && !fs::is_symlink(status)) {
        throw std::system_error(std::make_error_code(std::errc::file_exists), link_);
    }
    const std::string fresh = link_ + ".new";
    fs::remove(fresh, error);
    fs::create_symlink(target_, fresh, error);
    if (!error) fs::rename(fresh, link_, error);
    if (error) throw std::system_error(error, link_);
}

PtyLink::~PtyLink() {
    std::error_code error;
    if (fs::read_symlink(link_, error) == target_) fs::remove(link_, error);  // still ours
}

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

struct TcpBridge::State : std::enable_shared_from_this<TcpBridge::State> {
    using Buffer = std::array<std::uint8_t, 1024>;

    explicit State(const asio::any_io_executor& executor) : client(executor), device(executor) {}

    /// Replaces the former client.
    void serve(tcp::socket socket);
    void from_client(std::uint64_t connection);
    void from_device();

    tcp::socket client;
    asio::posix::stream_descriptor device;
    std::uint64_t connections = 0;  ///< completions of an earlier one are stale
    Buffer up{};
    Buffer down{};
};

void TcpBridge::State::serve(tcp::socket socket) {
    client = std::move(socket);
    error_code ignored;
    client.set_option(tcp::no_delay(true), ignored);
    client.non_blocking(true, ignored);
    from_client(++connections);
}

void TcpBridge::State::from_client(std::uint64_t connection) {
    client.async_read_some(
        asio::buffer(up), [self = shared_from_this(), connection](error_code error, std::size_t n) {
            if (connection != self->connections) return;
            if (error) {
                self->client.close(error);
                return;
            }
            // A pty takes a frame at once; the rest is lost, as on a wire.
            asio::write(self->device, asio::buffer(self->up, n), error);
            self->from_client(connection);
        });
}

void TcpBridge::State::from_device() {
    device.async_read_some(asio::buffer(down),
                           [self = shared_from_this()](error_code error, std::size_t n) {
                               if (error) return;
                               // A client that does not read loses bytes instead of stopping the
                               // line.
                               if (self->client.is_open())
                                   self->client.send(asio::buffer(self->down, n), 0, error);
                               self->from_device();
                           });
}

TcpBridge::TcpBridge(const asio::any_io_executor& executor, const config::Endpoint& endpoint,
                     const std::string& device)
    : state_(std::make_shared<State>(executor)),
      acceptor_(
          executor, [state = state_.get()](tcp::socket socket) { state->serve(std::move(socket)); },
          [](const error_code& why) {
              rt::log(rt::LogLevel::warn, "cannot accept", {{"reason", why.message()}});
          }) {
    const int fd = ::open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) throw std::system_error(errno, std::generic_category(), device);
    state_->device.assign(fd);
    state_->device.non_blocking(true);  // else a write would wait for readers on this very loop
    if (const error_code error = acceptor_.open(endpoint.address, endpoint.port)) {
        throw std::system_error(
            error, "cannot listen on " + endpoint_text(endpoint.address, endpoint.port));
    }
    state_->from_device();
}

TcpBridge::~TcpBridge() {
    error_code ignored;
    state_->client.close(ignored);
    state_->device.close(ignored);
}

std::uint16_t TcpBridge::port() const { return acceptor_.port(); }

SimulatedPanels::SimulatedPanels(boost::asio::any_io_executor executor)
    : executor_(std::move(executor)), clock_(executor_) {}

void SimulatedPanels::add(const config::Line& line, const std::string& link) {
    buses_.push_back(simulate_line(executor_, clock_, line));
    sim::SimulatedBus& bus = *buses_.back();
    bus.start();
    text_ += "line " + line.name + ": " + lead_to(line.name, bus.device(), link) + ", " +
             to_string(line.device.serial) + '\n';
    for (const config::Station& station : line.stations) {
        text_ += "  station " + std::to_string(station.id) + ' ' + station.name + ", " +
                 station.profile->name + '\n';
        web::StationEntry& entry = directory_.stations.emplace_back();
        entry.name = station.name;
        entry.line = line.name;
        entry.id = station.id;
        entry.profile = station.profile;
        entry.simulated = simulated_panel(buses_.back(), station.id);
    }
}

std::string SimulatedPanels::lead_to(const std::string& line, const std::string& device,
                                     const std::string& link) {
    if (link.empty()) return device;
    if (!link.starts_with(kTcpLink)) {
        links_.push_back(std::make_unique<PtyLink>(link, device));
        return link + " -> " + device;
    }
    const auto endpoint = config::parse_endpoint(link.substr(kTcpLink.size()));
    bridges_.push_back(std::make_unique<TcpBridge>(executor_, *endpoint, device));
    const std::string place = endpoint_text(endpoint->address, bridges_.back()->port());
    rt::log(rt::LogLevel::info, "listening", {{"line", line}, {"rtu_over_tcp", place}});
    return std::string(kTcpLink) + place;
}

void SimulatedPanels::serve_faults(const config::Endpoint& endpoint) {
    web::Settings settings;
    settings.address = endpoint.address;
    settings.port = endpoint.port;
    settings.anonymous = Role::admin;
    web::Providers providers;
    providers.ready = [] { return true; };
    providers.missing = [] { return std::string(); };
    providers.version = PANELGATE_VERSION;
    providers.commit = build_commit();
    providers.compiler = build_compiler();
    providers.libraries = build_libraries();
    providers.now = [this] { return clock_.now(); };
    providers.events = &nothing_happens_;
    http_ = std::make_unique<web::Server>(executor_, settings,
                                          std::make_shared<const web::Directory>(directory_),
                                          std::move(providers), web::Surface::simulator);
    if (const auto error = http_->start())
        throw std::system_error(error, "cannot listen on " + settings.name());
    const std::string place = endpoint_text(endpoint.address, http_->port());
    rt::log(rt::LogLevel::info, "listening", {{"http", place}});
    text_ += "faults: http://" + place + "/api/v1/simulator/{station}\n";
}

void SimulatedPanels::stop() {
    http_.reset();
    bridges_.clear();
    for (const auto& bus : buses_) bus->stop();
}

}  // namespace panelgate::gateway
