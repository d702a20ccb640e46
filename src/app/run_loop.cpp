#include "run_loop.hpp"

#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <csignal>
#include <memory>
#include <string>

#include "panelgate/base/time.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::app {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

constexpr auto kLook = 5ms;

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
    std::signal(SIGUSR1, SIG_IGN);  // sent by some log rotation scripts; it would end the gateway
    std::signal(SIGUSR2, SIG_IGN);
}

ExitCode SignalLoop::run(const Ending& ending) {
    Loop loop(io_, ending, ends_, reloads_);
    loop.start();
    io_.run();
    return loop.code();
}

}  // namespace panelgate::app
