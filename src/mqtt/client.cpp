#include "panelgate/mqtt/client.hpp"

#include <sys/socket.h>
#include <unistd.h>
#include <array>
#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/post.hpp>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "connection.hpp"
#include "panelgate/line/reopen.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::mqtt {

namespace asio = boost::asio;
using asio::posix::stream_descriptor;
using boost::system::error_code;

/// Sends what is queued, then keeps the socket until the broker has closed it. Closing a socket the
/// broker still writes to would reset the connection and lose what the broker has not read yet,
/// including the farewell.
class Closing final : public GracefulClose, public std::enable_shared_from_this<Closing> {
  public:
    Closing(asio::any_io_executor executor, int socket, rt::Clock& clock,
            std::shared_ptr<Connection> connection)
        : descriptor_(std::move(executor), socket),
          connection_(std::move(connection)),
          alarm_(clock.make_alarm()) {}

    bool done() const override { return !descriptor_.is_open(); }
    /// Ends at `until` at the latest.
    void start(TimePoint until) {
        alarm_->arm(until, [this] { end(); });
        go_on();
    }

  private:
    void go_on() {
        const bool sends = connection_->wants_write();
        if (!sends) ::shutdown(descriptor_.native_handle(), SHUT_WR);
        descriptor_.async_wait(sends ? stream_descriptor::wait_write : stream_descriptor::wait_read,
                               [weak = weak_from_this(), sends](const error_code& error) {
                                   const auto self = weak.lock();
                                   if (!self || self->done()) return;
                                   const bool goes_on =
                                       sends ? self->connection_->write().empty() : self->discard();
                                   !error&& goes_on ? self->go_on() : self->end();
                               });
    }
    /// Discards input; false if the broker has closed or the connection failed.
    bool discard() {
        std::array<char, 4096> nobody_reads{};
        while (true) {
            const auto size = ::recv(descriptor_.native_handle(), nobody_reads.data(),
                                     nobody_reads.size(), MSG_DONTWAIT);
            if (size < 0) return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
            if (size == 0) return false;
        }
    }
    void end() {
        alarm_->cancel();
        error_code ignored;
        descriptor_.close(ignored);
        connection_.reset();
    }

    stream_descriptor descriptor_;
    std::shared_ptr<Connection> connection_;
    std::unique_ptr<rt::Alarm> alarm_;
};

/// Connects without blocking the loop: name look-up and connect run in a detached thread, which is
/// never joined, not even at program exit. One connection at a time. Shared with the thread.
class Dialling : public std::enable_shared_from_this<Dialling> {
  public:
    /// Receives the connection, and the error text ("" on success).
    using Done = std::function<void(std::shared_ptr<Connection>, const std::string& failed)>;

    explicit Dialling(asio::any_io_executor executor) : loop_(std::move(executor)) {}

    /// Calls `done` once from the loop, unless cancelled or left first. Not while under way.
    void connect(std::shared_ptr<Connection> connection, Message will, Done done) {
        done_ = std::move(done);
        under_way_ = true;
        try {
            std::thread([self = shared_from_this(), made = connection,
                         last = std::move(will)]() mutable {
                sigset_t all;
                sigfillset(&all);
                ::pthread_sigmask(SIG_BLOCK, &all, nullptr);  // signals belong to the loop's thread
                std::string failed = made->connect(last);
                self->tell(std::move(made), std::move(failed));
            }).detach();
        } catch (const std::system_error& error) {
            tell(std::move(connection), error.code().message());
        }
    }
    void cancel() { done_ = nullptr; }
    bool under_way() const { return under_way_; }
    /// Nothing is called any more; the executor may end.
    void leave() {
        cancel();
        const std::lock_guard lock(mutex_);
        loop_.reset();
    }

  private:
    /// From any thread.
    void tell(std::shared_ptr<Connection> connection, std::string failed) {
        const std::lock_guard lock(mutex_);
        if (!loop_) return;
        asio::post(*loop_, [self = shared_from_this(), made = std::move(connection),
                            why = std::move(failed)]() mutable {
            self->under_way_ = false;
            if (const Done done = std::exchange(self->done_, nullptr)) done(std::move(made), why);
        });
    }

    std::mutex mutex_;
    std::optional<asio::any_io_executor> loop_;
    Done done_;
    bool under_way_ = false;
};

namespace {
using Protocol = Connection::Protocol;
constexpr Duration kLook = 1s;  // interval for libmosquitto's housekeeping
}  // namespace

struct Client::State : std::enable_shared_from_this<Client::State> {
    State(asio::any_io_executor e, rt::Clock& c, const Settings& s, Publisher& p, OnCommand o)
        : executor(std::move(e)),
          clock(c),
          settings(s),
          publisher(p),
          on_command(std::move(o)),
          dialling(std::make_shared<Dialling>(executor)),
          pauses(s.first_pause, s.longest_pause),
          alarm(clock.make_alarm()) {}
    ~State() { dialling->leave(); }
    State(const State&) = delete;
    State& operator=(const State&) = delete;

    void dial();
    void dialled(std::shared_ptr<Connection> made, const std::string& failed);
    void await_readable();
    void await_writable();
    void read();
    void housekeep();
    void digest();
    void accepted();
    void take_commands(const std::vector<Connection::Received>& received);
    void lost(const std::string& why);
    void judge_session();
    void retry();
    void pump();
    void wake();
    /// Guards completions: false once their connection is gone.
    auto current() {
        return [self = shared_from_this(), now = attempt] {
            return self->running && self->attempt == now;
        };
    }

    asio::any_io_executor executor;
    rt::Clock& clock;
    Settings settings;
    Publisher& publisher;
    OnCommand on_command;
    std::shared_ptr<Dialling> dialling;
    line::Reopen pauses;
    std::unique_ptr<rt::Alarm> alarm;  ///< next attempt, or next housekeeping
    std::shared_ptr<Connection> connection;
    /// A duplicate of libmosquitto's socket, which libmosquitto may close at any time.
    std::optional<stream_descriptor> descriptor;
    OpenMessages open;
    std::uint64_t attempt = 0;
    Protocol protocol = Protocol::mqtt5;   ///< of this connection, or the next one
    bool is_too_new = false;               ///< the protocol, for the broker
    std::optional<TimePoint> connack_due;  ///< CONNACK deadline, while it is awaited
    bool running = false;
    bool accepted_once = false;
    bool connected = false;
    TimePoint connected_since{};
    int short_sessions = 0;  ///< in a row
    bool awake = false;      ///< a pump() is posted
    bool writing = false;
    std::uint64_t published = 0;
    std::uint64_t reconnects = 0;
    std::uint64_t left_out = 0;
};

void Client::State::dial() {
    if (dialling->under_way()) return retry();
    ++attempt;
    dialling->connect(std::make_shared<Connection>(settings, settings.client_id, protocol),
                      publisher.will(),
                      [this, is_current = current()](std::shared_ptr<Connection> made,
                                                     const std::string& failed) {
                          if (is_current()) dialled(std::move(made), failed);
                      });
}

void Client::State::dialled(std::shared_ptr<Connection> made, const std::string& failed) {
    connection = std::move(made);
    if (!failed.empty()) return lost(failed);
    const int own = ::dup(connection->socket());
    if (own < 0) return lost(std::strerror(errno));
    descriptor.emplace(executor, own);
    connack_due = clock.now() + settings.connack_timeout;
    await_readable();
    await_writable();
    housekeep();
}

void Client::State::await_readable() {
    descriptor->async_wait(stream_descriptor::wait_read,
                           [this, is_current = current()](const error_code& error) {
                               if (!is_current()) return;
                               if (error) return lost(error.message());
                               read();
                           });
}

void Client::State::read() {
    const std::string why = connection->read(clock.now());
    digest();
    if (!connection) return;  // the broker refused the connection
    if (!why.empty()) return lost(why);
    await_readable();
    wake();
}

void Client::State::await_writable() {
    if (writing || !connection->wants_write()) return;
    writing = true;
    descriptor->async_wait(stream_descriptor::wait_write,
                           [this, is_current = current()](const error_code& error) {
                               if (!is_current()) return;
                               writing = false;
                               if (error) return lost(error.message());
                               const std::string why = connection->write();
                               if (!why.empty()) return lost(why);
                               wake();
                               await_writable();
                           });
}

void Client::State::housekeep() {
    if (connack_due && clock.now() >= *connack_due) return lost("the broker does not answer");
    const std::string why = connection->housekeep();
    if (!why.empty()) return lost(why);
    await_writable();
    alarm->arm(clock.now() + kLook, [this] { housekeep(); });
}

/// Processes the events libmosquitto reported while reading.
void Client::State::digest() {
    const Connection::Happened happened = connection->take();
    if (!happened.refused.empty()) {
        connack_due.reset();
        is_too_new = happened.is_too_new;
        return lost("the broker refuses: " + happened.refused);
    }
    if (happened.accepted) accepted();
    if (!happened.delivered.empty()) pauses.succeeded();  // a stable session that accepts messages
    for (const int id : happened.delivered)
        for (const std::uint64_t change : open.delivered(id)) publisher.delivered(change);
    for (const std::string& filter : happened.unsubscribed)
        rt::log(rt::LogLevel::warn, "mqtt subscription refused",
                {{"broker", settings.broker()},
                 {"topic", filter},
                 {"why", "the broker does not let this user read it: writes do not arrive"}});
    if (happened.left_out > 0)
        rt::log(rt::LogLevel::warn, "mqtt messages left out",
                {{"broker", settings.broker()},
                 {"why", "more than " + std::to_string(settings.messages) + " a second"}});
    left_out += happened.left_out;
    take_commands(happened.received);
}

void Client::State::accepted() {
    connack_due.reset();
    connected = true;
    connected_since = clock.now();
    if (accepted_once) ++reconnects;
    accepted_once = true;
    rt::log(rt::LogLevel::info, "mqtt connected",
            {{"broker", settings.broker()},
             {"client_id", settings.client_id},
             {"protocol", protocol == Protocol::mqtt5 ? "5" : "3.1.1"}});
    const std::vector<std::string> filters = publisher.subscriptions();
    for (const std::string& filter : filters) connection->subscribe(filter);
    if (protocol == Protocol::mqtt311 && !filters.empty())
        rt::log(rt::LogLevel::warn, "mqtt messages of any size",
                {{"broker", settings.broker()},
                 {"why",
                  "the broker knows no MQTT 5, by which it would keep what is too long for a "
                  "write; give the broker a limit, as message_size_limit of Mosquitto"}});
    publisher.connected();
    wake();
}

void Client::State::take_commands(const std::vector<Connection::Received>& received) {
    for (const Connection::Received& one : received) {
        for (const Command& command : publisher.commands(one.topic, one.payload, one.retained))
            on_command(command);
    }
}

/// Two clients with one id take the session from each other without an end (MQTT.js#684): each
/// connection is closed as soon as the other client has come back.
void Client::State::judge_session() {
    constexpr int kEnough = 3;
    constexpr Duration kShort = 5s;
    if (!connected) return;
    short_sessions = clock.now() - connected_since < kShort ? short_sessions + 1 : 0;
    if (short_sessions == kEnough)
        rt::log(rt::LogLevel::warn, "mqtt sessions end at once",
                {{"broker", settings.broker()},
                 {"hint", "is another client connected as " + settings.client_id +
                              "? Each needs a client_id of its own"}});
}

void Client::State::lost(const std::string& why) {
    rt::log(rt::LogLevel::warn, "mqtt not connected",
            {{"broker", settings.broker()}, {"why", why}});
    judge_session();
    ++attempt;
    // A broker that knows MQTT 3.1.1 alone may refuse a later one, or close without a word.
    const bool falls_back = connack_due.has_value() || std::exchange(is_too_new, false);
    protocol = falls_back && protocol == Protocol::mqtt5 ? Protocol::mqtt311 : Protocol::mqtt5;
    connected = false;
    writing = false;
    connack_due.reset();
    descriptor.reset();
    connection.reset();
    open.clear();
    publisher.disconnected();
    retry();
}

void Client::State::retry() {
    alarm->arm(clock.now() + pauses.next_pause(), [this] { dial(); });
}

void Client::State::wake() {
    if (awake || !running || !connected) return;
    awake = true;
    asio::post(executor, [self = shared_from_this()] {
        self->awake = false;
        if (self->running && self->connected) self->pump();
    });
}

/// Sends messages up to the in-flight limit, as long as the socket accepts them.
void Client::State::pump() {
    std::size_t sent = 0;
    while (open.size() < settings.in_flight && !connection->wants_write()) {
        if (sent++ == settings.batch) {
            wake();
            break;
        }
        const auto outgoing = publisher.next(rt::wall_now());
        if (!outgoing) break;
        const int id = connection->publish(outgoing->message);
        if (id == 0)
            return lost("it takes no message to " + outgoing->message.topic + ": " +
                        connection->failed());
        ++published;
        open.sent(id, outgoing->message.qos > 0, outgoing->change);
    }
    if (open.wants_barrier()) open.barrier(connection->barrier());
    await_writable();
}

Client::Client(asio::any_io_executor executor, rt::Clock& clock, const Settings& settings,
               Publisher& publisher, OnCommand on_command)
    : state_(std::make_shared<State>(std::move(executor), clock, settings, publisher,
                                     std::move(on_command))) {}

Client::~Client() { stop(); }

void Client::start() {
    state_->running = true;
    state_->dial();
}

std::shared_ptr<GracefulClose> Client::stop() {
    if (!std::exchange(state_->running, false)) return nullptr;
    state_->alarm->cancel();
    state_->dialling->cancel();
    std::shared_ptr<Closing> leaving;
    if (std::exchange(state_->connected, false) && state_->connection) {
        state_->connection->publish(state_->publisher.farewell(rt::wall_now()));
        state_->connection->disconnect();
        leaving = std::make_shared<Closing>(state_->executor, state_->descriptor->release(),
                                            state_->clock, std::move(state_->connection));
        leaving->start(state_->clock.now() + state_->settings.disconnect_timeout);
    }
    state_->descriptor.reset();
    state_->connection.reset();
    return leaving;
}

void Client::wake() { state_->wake(); }

void Client::renew(const tls::Material& files) { state_->settings.files = Files{files}; }

Counters Client::counters() const {
    Counters counters;
    counters.connected = state_->connected;
    counters.stored = state_->publisher.store().size();
    counters.published = state_->published;
    counters.dropped = state_->publisher.store().dropped();
    counters.results_dropped = state_->publisher.results_dropped();
    counters.reconnects = state_->reconnects;
    counters.writes_refused = state_->left_out;
    return counters;
}

}  // namespace panelgate::mqtt
