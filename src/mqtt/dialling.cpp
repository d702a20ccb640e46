#include "dialling.hpp"

#include <boost/asio/post.hpp>
#include <csignal>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>

namespace panelgate::mqtt {

namespace asio = boost::asio;

struct Dialling::State : std::enable_shared_from_this<Dialling::State> {
    explicit State(asio::any_io_executor executor) : loop(std::move(executor)) {}

    void dial(std::shared_ptr<Connection> connection, const Message& will);
    void tell(std::shared_ptr<Connection> connection, const std::string& failed);

    std::mutex mutex;                           ///< of `loop`, all that the thread shares
    std::optional<asio::any_io_executor> loop;  ///< nothing: nobody is there any more
    Done done;
    bool under_way = false;
};

/// In the thread. The loop may have ended meanwhile, and only the lock tells.
void Dialling::State::dial(std::shared_ptr<Connection> connection, const Message& will) {
    sigset_t all;
    sigfillset(&all);
    ::pthread_sigmask(SIG_BLOCK, &all, nullptr);  // they are the loop's
    std::string failed = connection->connect(will);
    const std::lock_guard lock(mutex);
    if (!loop) return;
    asio::post(*loop, [self = shared_from_this(), made = std::move(connection),
                       why = std::move(failed)]() mutable { self->tell(std::move(made), why); });
}

void Dialling::State::tell(std::shared_ptr<Connection> connection, const std::string& failed) {
    under_way = false;
    if (const Done asked = std::exchange(done, nullptr)) asked(std::move(connection), failed);
}

Dialling::Dialling(asio::any_io_executor executor)
    : state_(std::make_shared<State>(std::move(executor))) {}

Dialling::~Dialling() {
    cancel();
    const std::lock_guard lock(state_->mutex);
    state_->loop.reset();
}

void Dialling::connect(std::shared_ptr<Connection> connection, Message will, Done done) {
    state_->done = std::move(done);
    state_->under_way = true;
    try {
        std::thread([state = state_, made = connection, last = std::move(will)]() mutable {
            state->dial(std::move(made), last);
        }).detach();
    } catch (const std::system_error& error) {
        asio::post(*state_->loop, [state = state_, made = std::move(connection),
                                   why = std::string(error.code().message())]() mutable {
            state->tell(std::move(made), why);
        });
    }
}

void Dialling::cancel() { state_->done = nullptr; }

bool Dialling::under_way() const { return state_->under_way; }

}  // namespace panelgate::mqtt
