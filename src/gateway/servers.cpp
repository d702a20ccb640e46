#include "panelgate/gateway/servers.hpp"

#include <algorithm>
#include <boost/asio/ip/host_name.hpp>
#include <boost/system/errc.hpp>
#include <iterator>
#include <system_error>
#include <utility>

#include "panelgate/base/network.hpp"
#include "panelgate/config/endpoint.hpp"
#include "panelgate/line/tty_line.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/tcp_server/dispatch.hpp"

namespace panelgate::gateway {

namespace {

using boost::system::error_code;
namespace errc = boost::system::errc;

constexpr std::uint16_t kFirstFreePort = 1024;  // below, a right is needed

std::string where(const ListenerHandle& handle) {
    return endpoint_text(handle.address, handle.port);
}

std::string words(const error_code& why) {
    if (why == errc::address_not_available) return "this machine does not have the address yet";
    return why.message();
}

void log_wait(const ListenerHandle& handle, const error_code& why) {
    rt::log(rt::LogLevel::warn, "listener waits",
            {{handle.kind, where(handle)}, {"why", words(why)}});
}

}  // namespace

Openings::Openings(rt::Clock& clock) : clock_(clock), again_(clock.make_alarm()) {}

void Openings::open(const std::vector<ListenerHandle>& handles) {
    std::vector<Waiting> late;
    for (const ListenerHandle& handle : handles) {
        const error_code why = opened(handle);
        if (!why) continue;
        if (why != errc::address_not_available) {
            const std::string advice = listening_advice(why, handle.port);
            throw CannotListen("cannot listen on " + where(handle) + ": " + why.message() +
                               (advice.empty() ? "" : "; " + advice));
        }
        log_wait(handle, why);
        late.push_back({handle, why});
    }
    waiting_.insert(waiting_.end(), late.begin(), late.end());
    later();
}

void Openings::take_over(const std::vector<ListenerHandle>& handles) {
    for (const ListenerHandle& handle : handles) waiting_.push_back({handle, {}});
    try_again();
}

void Openings::forget(const void* owner) {
    std::erase_if(waiting_, [&](const Waiting& waiting) { return waiting.handle.owner == owner; });
    std::erase_if(listening_, [&](const auto& listening) { return listening.first == owner; });
}

error_code Openings::opened(const ListenerHandle& handle) {
    const error_code error = handle.open();
    if (error) return error;
    const std::string place = endpoint_text(handle.address, handle.opened_port());
    rt::log(rt::LogLevel::info, "listening", {{handle.kind, place}});
    listening_.emplace_back(handle.owner, handle.kind + ' ' + place);
    return error;
}

std::string Openings::listening() const {
    std::string text;
    for (const auto& [owner, place] : listening_) text += (text.empty() ? "" : ", ") + place;
    return text;
}

/// The gateway is serving already: no error here ends it any more.
void Openings::try_again() {
    for (Waiting& waiting : waiting_) {
        const error_code why = opened(waiting.handle);
        if (why && why != waiting.why) log_wait(waiting.handle, why);
        waiting.why = why;
    }
    later();
}

void Openings::later() {
    std::erase_if(waiting_, [](const Waiting& waiting) { return !waiting.why; });
    if (!waiting_.empty()) again_->arm(clock_.now() + kPause, [this] { try_again(); });
}

void Openings::stop() {
    again_->cancel();
    waiting_.clear();
    listening_.clear();
}

std::string Openings::missing() const {
    std::string text;
    for (const auto& [handle, why] : waiting_) {
        if (!text.empty()) text += ", ";
        text += handle.kind + ' ' + where(handle) + " (" + words(why) + ')';
    }
    return text;
}

std::string listening_advice(const boost::system::error_code& why, std::uint16_t port) {
    const std::string number = std::to_string(port);
    if (why == errc::permission_denied && port < kFirstFreePort) {
        return "ports below 1024 want CAP_NET_BIND_SERVICE (deploy/systemd gives it; or: setcap "
               "cap_net_bind_service=+ep on the program), or sysctl "
               "net.ipv4.ip_unprivileged_port_start=" +
               number + ", or a port from 1024 on";
    }
    if (why == errc::address_in_use)
        return "another program listens there: ss -ltnp 'sport = :" + number + "' shows which";
    if (why == errc::address_family_not_supported) return "IPv6 is off on this machine";
    return {};
}

namespace {

boost::system::error_code error_of(tcp_server::Listener& listener) {
    try {
        listener.start();
    } catch (const std::system_error& error) {
        return error.code();
    }
    return {};
}

ListenerHandle handle_of(const tcp_server::Settings& settings, tcp_server::Listener* listener) {
    return {"modbus_tcp",
            settings.address,
            settings.port,
            [listener] { return error_of(*listener); },
            [listener] { return listener->port(); },
            listener};
}

ListenerHandle handle_of(const web::Settings& settings, web::Server* server) {
    return {"http",
            settings.address,
            settings.port,
            [server] { return server->start(); },
            [server] { return server->port(); },
            server};
}

}  // namespace

Servers::Servers(web::Loops loops, rt::Clock& clock, tcp_server::StrayWrite stray)
    : loops_(std::move(loops)), clock_(clock), openings_(clock), stray_(std::move(stray)) {}

tcp_server::Settings Servers::completed(tcp_server::Settings settings,
                                        const config::Config& config) const {
    boost::system::error_code unknown;
    settings.host = boost::asio::ip::host_name(unknown);
    if (config.http) settings.url = config.http->scheme() + config.http->name() + '/';
    return settings;
}

Servers::Modbus Servers::make(const tcp_server::Settings& settings, const Plant& plant) {
    tcp_server::UnitMap units(settings, plant.listener_lines());
    return {settings,
            std::make_unique<tcp_server::Listener>(loops_.plant, clock_, settings, std::move(units),
                                                   PANELGATE_VERSION, stray_)};
}

Servers::Modbus* Servers::find(const tcp_server::Settings& settings) {
    const auto found = std::ranges::find_if(listeners_, [&](const Modbus& one) {
        return one.listener && one.settings.is_same_listener(settings);
    });
    return found == listeners_.end() ? nullptr : &*found;
}

/// True if a listener that is about to close uses the port, on the same or an overlapping address.
bool Servers::is_left_to(const ListenerHandle& handle, const config::Config& config) const {
    const auto meets = [&](const auto& settings) {
        const bool overlap = settings.address == handle.address ||
                             config::is_any_address(settings.address) ||
                             config::is_any_address(handle.address);
        return handle.port != 0 && settings.port == handle.port && overlap;
    };
    const auto leaves = [&](const Modbus& one) {
        return std::ranges::none_of(config.modbus_tcp, [&](const tcp_server::Settings& wanted) {
            return one.settings.is_same_listener(wanted);
        });
    };
    const bool http_leaves =
        http_ && !(config.http && http_->settings.is_same_listener(*config.http));
    return (http_leaves && meets(http_->settings)) ||
           std::ranges::any_of(
               listeners_, [&](const Modbus& one) { return leaves(one) && meets(one.settings); });
}

void Servers::open(const config::Config& config, const Plant& plant, const Web& web) try {
    open_new(config, plant, web);
} catch (...) {
    fresh_ = {};
    throw;
}

void Servers::open_new(const config::Config& config, const Plant& plant, const Web& web) {
    fresh_ = {};
    std::vector<ListenerHandle> now;
    const auto add = [&](ListenerHandle handle) {
        (is_left_to(handle, config) ? fresh_.late : now).push_back(std::move(handle));
    };
    for (const tcp_server::Settings& configured : config.modbus_tcp) {
        const tcp_server::Settings settings = completed(configured, config);
        if (find(settings) != nullptr) {
            fresh_.listeners.push_back({settings, nullptr});
            continue;
        }
        fresh_.listeners.push_back(make(settings, plant));
        add(handle_of(settings, fresh_.listeners.back().listener.get()));
    }
    if (config.http && !(http_ && http_->settings.is_same_listener(*config.http))) {
        auto server =
            std::make_unique<web::Server>(loops_, *config.http, web.directory(), web.providers());
        fresh_.http = Http{*config.http, std::move(server)};
        add(handle_of(*config.http, fresh_.http->server.get()));
    }
    openings_.open(now);
}

void Servers::apply(const config::Config& config, const Plant& plant,
                    const std::shared_ptr<const web::Directory>& directory,
                    std::function<std::string()> shown, Duration longest) {
    Fresh fresh = std::exchange(fresh_, {});
    for (Modbus& one : fresh.listeners) {
        if (one.listener) continue;
        one.listener = std::move(find(one.settings)->listener);
        one.listener->apply(one.settings,
                            tcp_server::UnitMap(one.settings, plant.listener_lines()));
    }
    for (Modbus& old : std::exchange(listeners_, std::move(fresh.listeners))) {
        if (old.listener) leave(std::move(old));
    }
    if (http_ && (fresh.http || !config.http)) leave(*std::exchange(http_, {}), longest);
    if (fresh.http) http_ = std::move(fresh.http);
    if (http_) {
        http_->settings = *config.http;
        http_->server->apply(*config.http, directory, std::move(shown));
    }
    apply_masters(config, plant);
    openings_.take_over(fresh.late);
}

/// Keeps the listener until its last client has gone.
void Servers::leave(Modbus modbus) {
    openings_.forget(modbus.listener.get());
    leaving_->push_back(std::move(modbus));
    const auto place = std::prev(leaving_->end());
    place->listener->stop([list = std::weak_ptr(leaving_), place] {
        if (const auto alive = list.lock()) alive->erase(place);
    });
}

void Servers::leave(Http http, Duration longest) {
    openings_.forget(http.server.get());
    std::erase_if(leaving_http_, [](const Http& old) { return old.server->connections() == 0; });
    http.server->stop(longest);
    leaving_http_.push_back(std::move(http));
}

void Servers::apply_masters(const config::Config& config, const Plant& plant) {
    const auto lines = plant.listener_lines(explain::Unlisted::refused);
    std::vector<Master> before = std::exchange(masters_, {});
    for (const serial_server::Settings& settings : config.serial_masters) {
        const auto same = std::ranges::find_if(
            before, [&](const Master& one) { return one.settings.is_same_port(settings); });
        if (same == before.end()) {
            masters_.push_back({settings, nullptr});
            continue;
        }
        masters_.push_back({settings, std::move(same->master)});
        masters_.back().master->apply(settings, tcp_server::UnitMap(settings.access, lines));
        before.erase(same);
    }
    before.clear();  // a removed master's device may be a new one's
    for (Master& one : masters_) {
        if (one.master) continue;
        line::Settings device = one.settings.device;
        device.owner = "serial master '" + one.settings.name + '\'';
        one.master = std::make_unique<serial_server::SerialMaster>(
            clock_, one.settings, tcp_server::UnitMap(one.settings.access, lines),
            line::make_tty_line(loops_.plant, clock_, std::move(device)));
        one.master->start();
    }
}

void Servers::renew(const std::string& listener, const tls::Settings& settings) {
    for (const Modbus& one : listeners_)
        if ("modbus_tcp " + one.settings.name() == listener) one.listener->renew(settings);
    if (http_ && "http " + http_->settings.name() == listener) http_->server->renew(settings);
}

void Servers::review() {
    for (const Modbus& one : listeners_) one.listener->review();
    if (http_ && http_->settings.tls) http_->server->review();
}

void Servers::stop_accepting(Duration longest) {
    openings_.stop();
    open_listeners_ = listeners_.size();
    for (const Modbus& one : listeners_) one.listener->stop([this] { --open_listeners_; });
    for (const Master& one : masters_) one.master->finish();
    if (http_) http_->server->stop(longest);
}

bool Servers::drained() {
    const auto idle = [](const Master& one) { return one.master->idle(); };
    const auto silent = [](const Http& one) { return one.server->connections() == 0; };
    return open_listeners_ == 0 && leaving_->empty() && std::ranges::all_of(masters_, idle) &&
           (!http_ || silent(*http_)) && std::ranges::all_of(leaving_http_, silent);
}

std::size_t Servers::pending_connections() const {
    std::size_t count = http_ ? http_->server->connections() : 0;
    for (const Http& old : leaving_http_) count += old.server->connections();
    for (const Modbus& one : listeners_) count += one.listener->counters().connections;
    for (const Modbus& old : *leaving_) count += old.listener->counters().connections;
    for (const Master& one : masters_) count += one.master->idle() ? 0 : 1;
    return count;
}

void Servers::close() {
    for (const Modbus& one : listeners_) one.listener->close_now();
    for (const Modbus& old : *leaving_) old.listener->close_now();
    for (const Master& one : masters_) one.master->stop();
    http_.reset();
    leaving_http_.clear();
}

void Servers::copy_figures(metrics::Snapshot& figures) const {
    for (const Modbus& one : listeners_) figures.listeners.push_back(one.listener->counters());
    for (const Master& one : masters_) figures.serial_masters.push_back(one.master->counters());
    if (http_) figures.http = http_->server->counters();
}

}  // namespace panelgate::gateway
