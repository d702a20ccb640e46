#include "panelgate/mqtt/client.hpp"

#include <unistd.h>

#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/post.hpp>
#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>
#include <vector>

#include "connection.hpp"
#include "dialling.hpp"
#include "open_messages.hpp"
#include "panelgate/line/reopen.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::mqtt {

namespace asio = boost::asio;
using asio::posix::stream_descriptor;
using boost::system::error_code;

namespace {
constexpr Duration kLook = 1s;  // libmosquitto wants to be looked after so often
}

struct Client::State : std::enable_shared_from_this<Client::State> {
    State(asio::any_io_executor e, rt::Clock& c, const Settings& s, Publisher& p, OnCommand o)
        : executor(std::move(e)),
          clock(c),
          settings(s),
          publisher(p),
          on_command(std::move(o)),
          dialling(executor),
          pauses(s.first_pause, s.longest_pause),
          alarm(clock.make_alarm()) {}

    void dial();
    void dialled(std::shared_ptr<Connection> made, const std::string& failed);
    void attach();
    void wait_for_bytes();
    void wait_for_room();
    void read();
    void look_after();
    void digest();
    void accepted();
    void take_commands(const std::vector<Connection::Received>& received);
    void lost(const std::string& why);
    void retry();
    void pump();
    void wake();
    bool send(const Publisher::Outgoing& outgoing);
    /// For completions: nothing of a connection that has gone.
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
    Dialling dialling;
    line::Reopen pauses;
    std::unique_ptr<rt::Alarm> alarm;  ///< the next attempt, or the next look
    std::shared_ptr<Connection> connection;
    /// Of the same socket as libmosquitto's, which closes its own whenever it likes.
    std::optional<stream_descriptor> descriptor;
    OpenMessages open;
    std::uint64_t attempt = 0;
    std::optional<TimePoint> accept_by;  ///< the broker has not said yet whether it takes us
    bool running = false;
    bool accepted_once = false;
    bool connected = false;
    bool awake = false;  ///< a turn is to come
    bool writing = false;
    std::uint64_t published = 0;
    std::uint64_t reconnects = 0;
};

void Client::State::dial() {
    if (dialling.under_way()) return retry();
    ++attempt;
    dialling.connect(std::make_shared<Connection>(settings, settings.client_id), publisher.will(),
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
    accept_by = clock.now() + settings.accepted_in;
    attach();
}

void Client::State::attach() {
    wait_for_bytes();
    wait_for_room();
    look_after();
}

void Client::State::wait_for_bytes() {
    descriptor->async_wait(stream_descriptor::wait_read,
                           [this, is_current = current()](const error_code& error) {
                               if (!is_current()) return;
                               if (error) return lost(error.message());
                               read();
                           });
}

void Client::State::read() {
    const std::string why = connection->read();
    digest();
    if (!connection) return;  // the broker has refused us
    if (!why.empty()) return lost(why);
    wait_for_bytes();
    wake();
}

void Client::State::wait_for_room() {
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
                               wait_for_room();
                           });
}

void Client::State::look_after() {
    if (accept_by && clock.now() >= *accept_by) return lost("the broker does not answer");
    const std::string why = connection->look_after();
    if (!why.empty()) return lost(why);
    wait_for_room();
    alarm->arm(clock.now() + kLook, [this] { look_after(); });
}

/// What libmosquitto has told while it read.
void Client::State::digest() {
    const Connection::Happened happened = connection->take();
    if (!happened.refused.empty()) return lost("the broker refuses: " + happened.refused);
    if (happened.accepted) accepted();
    if (!happened.delivered.empty()) pauses.succeeded();  // it keeps us, and takes what we say
    for (const int id : happened.delivered)
        for (const std::uint64_t change : open.delivered(id)) publisher.delivered(change);
    take_commands(happened.received);
}

void Client::State::accepted() {
    accept_by.reset();
    connected = true;
    if (accepted_once) ++reconnects;
    accepted_once = true;
    rt::log(rt::LogLevel::info, "mqtt connected",
            {{"broker", settings.broker()}, {"client_id", settings.client_id}});
    for (const std::string& filter : publisher.subscriptions()) connection->subscribe(filter);
    publisher.connected();
    wake();
}

void Client::State::take_commands(const std::vector<Connection::Received>& received) {
    for (const Connection::Received& one : received) {
        for (const Command& command : publisher.commands(one.topic, one.payload, one.retained))
            on_command(command);
    }
}

void Client::State::lost(const std::string& why) {
    rt::log(rt::LogLevel::warn, "mqtt not connected",
            {{"broker", settings.broker()}, {"why", why}});
    ++attempt;
    connected = false;
    writing = false;
    accept_by.reset();
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

/// Fills what may be on its way, as long as the socket takes it.
void Client::State::pump() {
    std::size_t sent = 0;
    while (open.size() < settings.in_flight && !connection->wants_write()) {
        if (sent++ == settings.batch) {
            wake();
            break;
        }
        const auto outgoing = publisher.next(rt::wall_now());
        if (!outgoing) break;
        if (!send(*outgoing)) return lost("the connection takes nothing");
    }
    if (open.wants_barrier()) open.barrier(connection->barrier());
    wait_for_room();
}

bool Client::State::send(const Publisher::Outgoing& outgoing) {
    const int id = connection->publish(outgoing.message);
    if (id == 0) return false;
    ++published;
    open.sent(id, outgoing.message.qos > 0, outgoing.change);
    return true;
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

std::unique_ptr<Leaving> Client::stop() {
    if (!std::exchange(state_->running, false)) return nullptr;
    state_->alarm->cancel();
    state_->dialling.cancel();
    std::unique_ptr<Leaving> leaving;
    if (std::exchange(state_->connected, false) && state_->connection) {
        state_->connection->publish(state_->publisher.farewell(rt::wall_now()));
        state_->connection->disconnect();
        leaving = std::make_unique<Leaving>(state_->executor, state_->descriptor->release(),
                                            state_->clock, std::move(state_->connection),
                                            state_->settings.leave_within);
    }
    state_->descriptor.reset();
    state_->connection.reset();
    return leaving;
}

void Client::wake() { state_->wake(); }

Counters Client::counters() const {
    Counters counters;
    counters.connected = state_->connected;
    counters.stored = state_->publisher.store().size();
    counters.published = state_->published;
    counters.dropped = state_->publisher.store().dropped();
    counters.results_dropped = state_->publisher.results_dropped();
    counters.reconnects = state_->reconnects;
    return counters;
}

}  // namespace panelgate::mqtt
