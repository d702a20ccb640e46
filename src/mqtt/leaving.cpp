#include "panelgate/mqtt/leaving.hpp"

#include <sys/socket.h>

#include <array>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cerrno>
#include <utility>

#include "connection.hpp"

namespace panelgate::mqtt {

namespace asio = boost::asio;
using asio::posix::stream_descriptor;
using boost::system::error_code;

struct Leaving::State : std::enable_shared_from_this<Leaving::State> {
    State(asio::any_io_executor executor, int socket, rt::Clock& clock,
          std::shared_ptr<Connection> c)
        : descriptor(std::move(executor), socket),
          connection(std::move(c)),
          alarm(clock.make_alarm()) {}

    void send();
    void drain();
    bool discard();
    void end();

    stream_descriptor descriptor;
    std::shared_ptr<Connection> connection;
    std::unique_ptr<rt::Alarm> alarm;
    bool done = false;
};

void Leaving::State::send() {
    if (connection->wants_write()) {
        descriptor.async_wait(stream_descriptor::wait_write,
                              [self = shared_from_this()](const error_code& error) {
                                  if (self->done) return;
                                  if (error || !self->connection->write().empty())
                                      return self->end();
                                  self->send();
                              });
        return;
    }
    ::shutdown(descriptor.native_handle(), SHUT_WR);
    drain();
}

void Leaving::State::drain() {
    descriptor.async_wait(stream_descriptor::wait_read,
                          [self = shared_from_this()](const error_code& error) {
                              if (self->done) return;
                              if (error || !self->discard()) return self->end();
                              self->drain();
                          });
}

/// False: the broker has closed as well, or there is no connection any more.
bool Leaving::State::discard() {
    std::array<char, 4096> nobody_reads{};
    while (true) {
        const auto size = ::recv(descriptor.native_handle(), nobody_reads.data(),
                                 nobody_reads.size(), MSG_DONTWAIT);
        if (size < 0) return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
        if (size == 0) return false;
        if (static_cast<std::size_t>(size) < nobody_reads.size()) return true;
    }
}

void Leaving::State::end() {
    if (std::exchange(done, true)) return;
    alarm->cancel();
    error_code ignored;
    descriptor.close(ignored);
    connection.reset();
}

Leaving::Leaving(asio::any_io_executor executor, int socket, rt::Clock& clock,
                 std::shared_ptr<Connection> connection, Duration within)
    : state_(std::make_shared<State>(std::move(executor), socket, clock, std::move(connection))) {
    state_->alarm->arm(clock.now() + within, [state = state_.get()] { state->end(); });
    state_->send();
}

Leaving::~Leaving() { state_->end(); }

bool Leaving::done() const { return state_->done; }

}  // namespace panelgate::mqtt
