#include "command_run.hpp"

#include <malloc.h>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "commands.hpp"
#include "panelgate/base/network.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/config/endpoint.hpp"
#include "panelgate/explain/load.hpp"
#include "panelgate/gateway/configuration_text.hpp"
#include "panelgate/gateway/gateway.hpp"
#include "panelgate/gateway/prepare.hpp"
#include "panelgate/gateway/reloader.hpp"
#include "panelgate/rt/asio_clock.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/rt/loop.hpp"
#include "panelgate/rt/process.hpp"

namespace panelgate::commands {

namespace {

namespace asio = boost::asio;
using boost::system::error_code;

constexpr auto kLook = 5ms;
constexpr int kFacesNice = 5;  ///< of the thread of the faces: the lines' frames go first

/// Lives on run()'s stack while the loop runs.
class Loop {
  public:
    Loop(asio::io_context& io, const Ending& ending, asio::signal_set& ends,
         asio::signal_set& reloads)
        : io_(io), ending_(ending), ends_(ends), reloads_(reloads), look_(io), limit_(io) {}

    void start() {
        wait_for_end();
        wait_for_reload();
    }
    ExitCode code() const { return code_; }

  private:
    void wait_for_end() {
        ends_.async_wait([this](error_code error, int) {
            if (error) return;
            if (ending_now_) {
                cut();
                return;
            }
            ending_now_ = true;
            rt::log(rt::LogLevel::info, "stopping");
            ending_.begin();
            limit_.expires_after(ending_.patience());
            limit_.async_wait([this](error_code late) {
                if (!late) finish();
            });
            look();
            wait_for_end();
        });
    }

    /// The user does not want to wait for the outstanding answers.
    void cut() {
        if (!finished_ && !ending_.done()) {
            code_ = kCut;
            rt::log(rt::LogLevel::warn, "stopped at once",
                    {{"why", "a second signal came: what is in flight is not answered"},
                     {"connections", std::to_string(ending_.open ? ending_.open() : 0)}});
        }
        finish();
    }

    void look() {
        if (ending_.done()) {
            finish();
            return;
        }
        look_.expires_after(kLook);
        look_.async_wait([this](error_code error) {
            if (!error) look();
        });
    }

    void wait_for_reload() {
        reloads_.async_wait([this](error_code error, int) {
            if (error) return;
            if (ending_.reload && !ending_now_) {
                ending_.reload();
            } else {
                rt::log(rt::LogLevel::warn, "no reload",
                        {{"why", ending_now_ ? "it is stopping" : "there is no file to be read"}});
            }
            wait_for_reload();
        });
    }

    void finish() {
        if (finished_) return;
        finished_ = true;
        ending_.finish();
        io_.stop();
    }

    asio::io_context& io_;
    const Ending& ending_;
    asio::signal_set& ends_;
    asio::signal_set& reloads_;
    asio::steady_timer look_;
    asio::steady_timer limit_;
    bool ending_now_ = false;
    bool finished_ = false;
    ExitCode code_ = kFine;
};

/// A signal after the last turn of the loop must not end the process by its default action, with
/// another exit code. Never destroyed: destroying the last signal_set restores the default.
void keep_until_the_process_goes() {
    struct Kept {
        asio::io_context nobody_runs{1};
        asio::signal_set signals{nobody_runs, SIGTERM, SIGINT, SIGHUP};
    };
    static const auto* kept = std::make_unique<Kept>().release();
    static_cast<void>(kept);
}

}  // namespace

SignalLoop::SignalLoop(asio::io_context& io)
    : io_(io), ends_(io, SIGTERM, SIGINT), reloads_(io, SIGHUP) {
    keep_until_the_process_goes();
    std::signal(SIGPIPE, SIG_IGN);  // the reader of our output may close it
    std::signal(SIGXFSZ, SIG_IGN);  // a file at its limit (ulimit -f) is a full disk, no death
    std::signal(SIGUSR1, SIG_IGN);  // sent by some log rotation scripts; it would end the gateway
    std::signal(SIGUSR2, SIG_IGN);
}

ExitCode SignalLoop::run(const Ending& ending) {
    Loop loop(io_, ending, ends_, reloads_);
    loop.start();
    io_.run();
    return loop.code();
}

using Embedded = std::vector<std::pair<std::string_view, std::string_view>>;
const Embedded& shipped_demo();  // config/demo.yaml, compiled in

namespace {

/// How a configuration is served.
struct Service {
    bool simulate = false;
    std::string file{};  ///< to read again on reload
    bool watch = false;  ///< reload as soon as the file has changed
    std::string text{};  ///< of the configuration that is served first
};

void reload_file(gateway::Reloader& reloader, const std::string& cause) {
    const std::string why = reloader.barred(false);
    if (!why.empty()) return rt::log(rt::LogLevel::warn, "no reload", {{"why", why}});
    reloader.reload({}, cause, [](const auto&) {});  // the log reports the result
}

/// Adapts the process to the configuration, and the configuration to the process.
std::shared_ptr<const config::Config> fitted(config::Config config) {
    rt::set_up_log(config.log);
    for (const gateway::StartMessage& message : gateway::prepare(config))
        rt::log(rt::LogLevel::warn, message.event, {{"warning", message.text}});
    for (const std::string& refused : rt::be_punctual(config.realtime))
        rt::log(rt::LogLevel::warn, "not granted", {{"what", refused}});
    return std::make_shared<const config::Config>(std::move(config));
}

std::string url_of(const config::Config& config, const gateway::Gateway& gateway) {
    return config.http->scheme() +
           endpoint_text(config::reachable(config.http->address), gateway.http_port());
}

/// Logs the URL of the dashboard.
void log_dashboard(const gateway::Gateway& gateway) {
    const config::Config& config = *gateway.config();
    if (!config.http) return;
    rt::log(rt::LogLevel::info, "dashboard", {{"url", url_of(config, gateway) + '/'}});
}

std::unique_ptr<gateway::FileWatch> watch_of(const Service& service,
                                             const asio::any_io_executor& executor,
                                             rt::Clock& clock, gateway::Reloader& reloader) {
    if (!service.watch) return nullptr;
    const auto files = [&reloader, file = service.file] {
        std::vector<std::string> all{file};
        for (const config::Line& line : reloader.running()->lines)
            for (const config::Station& station : line.stations)
                if (!station.points_file.empty()) all.push_back(station.points_file);
        return all;
    };
    return std::make_unique<gateway::FileWatch>(
        executor, clock, files, [&reloader] { reload_file(reloader, "the file has changed"); });
}

/// Ends the process soon, though a thread should wait for a disk or a share that does not answer.
void end_at_the_latest() try {
    constexpr std::chrono::seconds kForDisks(5);
    std::thread([kForDisks] {
        std::this_thread::sleep_for(kForDisks);
        rt::log(
            rt::LogLevel::error, "stopped without waiting",
            {{"why", "a disk or a share does not answer: a file is still being read or written"}});
        std::_Exit(kFine);
    }).detach();
} catch (const std::system_error&) {  // no more threads: the process waits
}

void stop(gateway::Gateway& gateway) {
    end_at_the_latest();
    gateway.stop();
}

/// Runs the gateway until a signal ends it. `started` is called once it serves.
ExitCode serve(config::Config config, const Service& service,
               const std::function<void(const gateway::Gateway&)>& started) {
    auto shared = fitted(std::move(config));
    boost::asio::io_context io(1);
    rt::AsioClock clock(io.get_executor());
    const rt::LogDrain drain(clock, io.get_executor());
    rt::ServiceManager manager(clock);
    SignalLoop loop(io);
    gateway::Reloader reloader(io.get_executor(), clock, service.file);
    gateway::ConfigurationText text(io.get_executor(), reloader, service.text);
    const rt::Loop faces(kFacesNice);
    gateway::Gateway gateway({faces.get_executor(), io.get_executor()}, shared, service.simulate,
                             &reloader, &text);
    try {
        gateway.start();
    } catch (const std::runtime_error& error) {
        rt::log(rt::LogLevel::error, "cannot start", {{"reason", error.what()}});
        return kUnavailable;
    }
    text.keep_in(gateway.journal());
    reloader.serve(gateway);
    reloader.on_step([&](bool begins) { begins ? manager.reloading() : manager.ready(); });
    started(gateway);
    ::malloc_trim(0);  // reading takes far more memory than is kept
    manager.ready([&gateway] { return gateway.status(); });
    const auto watch = watch_of(service, io.get_executor(), clock, reloader);
    Ending ending{.begin = {},
                  .done = [&] { return gateway.drained(); },
                  .finish = [&] { stop(gateway); },
                  .open = [&] { return gateway.pending_connections(); },
                  .longest_answer = {},
                  .reload = [&] { reload_file(reloader, "SIGHUP"); }};
    ending.begin = [&] {
        reloader.stop();
        ending.longest_answer = gateway.longest_answer();
        manager.stopping(ending.patience());
        gateway.stop_accepting();
    };
    return loop.run(ending);
}

void print_demo_help(const config::Config& config, const gateway::Gateway& gateway) {
    const std::string url = url_of(config, gateway);
    const std::string host = config::reachable(config.modbus_tcp[0].address);
    const std::string port = std::to_string(gateway.modbus_port());
    std::cout << "\npanelgate demo: five simulated panels on one RS-485 line (floor1, "
              << to_string(config.lines[0].device.serial) << "), asked for real over a pty.\n\n"
              << "  Dashboard: " << url << "/\n\n"
              << "  press 31 autonics-gplp-s   mixer 5 autonics-gp-2005   io 17 autonics-arm\n"
              << "  oven 20 panasonic-gt       filler 1 omron-cp2e\n\n"
              << "Try, in another terminal:\n"
              << "  panelgate read oven/temperature --http " << url.substr(url.rfind('/') + 1)
              << '\n'
              << "  curl -s " << url << "/api/v1/stations\n"
              << "  curl -s '" << url << "/api/v1/stations/press/devices/UW0?count=5'\n"
              << "  curl -s -X PUT -d '{\"values\":[215]}' " << url
              << "/api/v1/stations/oven/devices/GDT108\n"
              << "  curl -s " << url << "/api/v1/stations/oven/points\n"
              << "  curl -s " << url << "/api/v1/relays\n"
              << "  mbpoll -m tcp -p " << port << " -a 31 -t 4 -r 1 -c 5 -1 " << host << "\n\n"
              << "Also: " << url << "/metrics and " << url << "/api/v1/lines/floor1/trace?last=20\n"
              << "Ctrl-C ends it.\n"
              << std::flush;
    std::cout.clear();  // it runs even if stdout takes nothing
}

/// Replaces the address of `settings` by ADDR:PORT; false, with a message on stderr, if the text is
/// not one.
template <class Settings>
bool listen_on(const std::string& text, Settings& settings) {
    if (text.empty()) return true;
    const auto endpoint = config::parse_endpoint(text);
    if (!endpoint) {
        std::cerr << "panelgate: '" << text << "' is not ADDR:PORT, such as 127.0.0.1:8080\n";
        return false;
    }
    settings.address = endpoint->address;
    settings.port = endpoint->port;
    return true;
}

}  // namespace

ExitCode run(const std::string& file, bool simulate, bool watch) {
    std::signal(SIGHUP, SIG_IGN);  // a reload during start-up is not needed: the file is being read
    if (watch && file == "-") {
        std::cerr << "panelgate: --watch needs a file: standard input is read only once\n";
        return kUsage;
    }
    explain::Loaded loaded = explain::load_file(file);
    if (!loaded.config) return loaded.code;
    return serve(std::move(*loaded.config), {simulate, file, watch, std::move(loaded.text)},
                 log_dashboard);
}

ExitCode demo(const std::string& http, const std::string& modbus) {
    const std::string_view text = shipped_demo().front().second;
    explain::Loaded loaded = explain::load_text(text, "demo.yaml");
    if (!loaded.config) return loaded.code;
    config::Config& config = *loaded.config;
    if (!listen_on(http, *config.http) || !listen_on(modbus, config.modbus_tcp[0])) return kUsage;
    const config::Config shown = config;
    return serve(std::move(config), {.text = std::string(text)},
                 [&](const gateway::Gateway& gateway) {
                     log_dashboard(gateway);
                     print_demo_help(shown, gateway);
                 });
}

}  // namespace panelgate::commands
