#include "name_lookup.hpp"

#include <atomic>
#include <boost/asio/error.hpp>
#include <boost/asio/execution/outstanding_work.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/prefer.hpp>
#include <csignal>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>

namespace panelgate::line {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

struct NameLookup::State : std::enable_shared_from_this<NameLookup::State> {
    State(asio::any_io_executor e, TcpEndpoint of)
        : executor(std::move(e)), loop(executor), endpoint(std::move(of)) {}

    void start();
    void look_up();
    void tell(const error_code& error, const Addresses& addresses);

    asio::any_io_executor executor;
    std::mutex mutex;                           ///< of `loop`, all that the thread shares
    std::optional<asio::any_io_executor> loop;  ///< nothing: nobody is there any more
    const TcpEndpoint endpoint;
    std::optional<asio::any_io_executor> work;  ///< the loop has something to wait for
    Found found;
    bool under_way = false;
};

namespace {

std::atomic<int> threads;

/// The calling thread waits for as long as the system's resolver does.
std::pair<error_code, NameLookup::Addresses> resolve(const TcpEndpoint& endpoint) {
    asio::io_context own;
    tcp::resolver resolver(own);
    error_code error;
    auto addresses =
        resolver.resolve(endpoint.host, endpoint.port, tcp::resolver::numeric_service, error);
    return {error, std::move(addresses)};
}

}  // namespace

/// In the thread. The loop may have ended meanwhile, and only the lock tells.
void NameLookup::State::look_up() {
    sigset_t all;
    sigfillset(&all);
    ::pthread_sigmask(SIG_BLOCK, &all, nullptr);  // they are the loop's
    auto [error, addresses] = resolve(endpoint);
    --threads;
    const std::lock_guard lock(mutex);
    if (!loop) return;
    asio::post(*loop, [self = shared_from_this(), why = error, results = std::move(addresses)] {
        self->tell(why, results);
    });
}

void NameLookup::State::start() {
    under_way = true;
    error_code failed;
    if (++threads > kMostThreads) {
        failed = asio::error::try_again;
    } else {
        try {
            std::thread([self = shared_from_this()] { self->look_up(); }).detach();
        } catch (const std::system_error& error) {
            failed = error.code();
        }
    }
    if (!failed) return;
    --threads;
    asio::post(executor, [self = shared_from_this(), failed] { self->tell(failed, {}); });
}

void NameLookup::State::tell(const error_code& error, const Addresses& addresses) {
    under_way = false;
    work.reset();
    if (const Found asked = std::exchange(found, nullptr)) asked(error, addresses);
}

NameLookup::NameLookup(asio::any_io_executor executor, TcpEndpoint endpoint)
    : state_(std::make_shared<State>(std::move(executor), std::move(endpoint))) {}

NameLookup::~NameLookup() {
    cancel();
    const std::lock_guard lock(state_->mutex);
    state_->loop.reset();
}

void NameLookup::ask(Found found) {
    state_->found = std::move(found);
    state_->work = asio::prefer(state_->executor, asio::execution::outstanding_work.tracked);
    if (!state_->under_way) state_->start();
}

void NameLookup::cancel() {
    state_->found = nullptr;
    state_->work.reset();
}

bool NameLookup::waits() const { return state_->found != nullptr; }

}  // namespace panelgate::line
