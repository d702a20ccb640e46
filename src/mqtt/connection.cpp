#include "connection.hpp"

#include <mosquitto.h>
#include <mqtt_protocol.h>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace panelgate::mqtt {

namespace {

/// Initialises the C library, once per program.
void set_up_library() {
    static const int ready = mosquitto_lib_init();
    static_cast<void>(ready);
}

/// Returns the error text; errno must be that of the failed call.
std::string why(int code) {
    if (code == MOSQ_ERR_SUCCESS) return "";
    if (code == MOSQ_ERR_ERRNO) return std::strerror(errno);
    if (code == MOSQ_ERR_CONN_LOST) return "the broker has closed the connection";
    if (code == MOSQ_ERR_KEEPALIVE) return "the broker does not answer";
    return mosquitto_strerror(code);
}

const char* or_null(const std::string& text) { return text.empty() ? nullptr : text.c_str(); }

mosquitto* new_session(const std::string& client_id, void* owner) {
    set_up_library();
    mosquitto* session = mosquitto_new(client_id.c_str(), true, owner);
    if (session == nullptr) throw std::runtime_error("libmosquitto has no memory");
    return session;
}

constexpr int kReads = 64;  // per wake-up
/// A write met the broker's reset before libmosquitto read the alert ahead of the reset.
constexpr const char* kClosed =
    "TLS: the broker ends it: the connection was closed (it may not know `tls: certificate`)";
constexpr int kFirstFault = 0x80;  // of MQTT's reason codes
constexpr const char* kNothing = "panelgate/barrier";

}  // namespace

/// libmosquitto's callbacks, with libmosquitto's parameter order. No callback calls libmosquitto.
struct Connection::Callbacks {
    static Connection& of(void* owner) { return *static_cast<Connection*>(owner); }

    static void connected(mosquitto*, void* owner, int code) {
        const bool is_new = of(owner).protocol_ == Protocol::mqtt5;
        Happened& happened = of(owner).happened_;
        happened.accepted = code == 0;
        happened.is_too_new = is_new && code == MQTT_RC_UNSUPPORTED_PROTOCOL_VERSION;
        if (code != 0)
            happened.refused =
                is_new ? mosquitto_reason_string(code) : mosquitto_connack_string(code);
    }
    static void disconnected(mosquitto*, void* owner, int code) {
        if (code >= kFirstFault) of(owner).ended_ = mosquitto_reason_string(code);
    }
    static void subscribed(mosquitto*, void* owner, int id, int, const int* granted) {
        Connection& own = of(owner);
        const auto asked = own.asked_.find(id);
        if (asked == own.asked_.end()) return;
        if (*granted >= kFirstFault) own.happened_.unsubscribed.push_back(asked->second);
        own.asked_.erase(asked);
    }
    static void delivered(mosquitto*, void* owner, int id) {
        of(owner).happened_.delivered.push_back(id);
    }
    /// "OpenSSL Error[0]: error:0A000418:SSL routines::tlsv1 alert unknown ca"
    static void logged(mosquitto*, void* owner, int, const char* text) {
        const std::string_view line(text);
        if (line.starts_with("OpenSSL Error") && of(owner).tls_error_.empty())
            of(owner).tls_error_ = line.substr(line.rfind(':') + 1);
    }
    static void received(mosquitto*, void* owner, const mosquitto_message* message) {
        if (!of(owner).has_turn()) return;
        const Settings& settings = of(owner).settings_;
        const auto size = static_cast<std::size_t>(message->payloadlen);
        // One byte more marks an oversized payload.
        const std::size_t kept = size > settings.payload ? settings.payload + 1 : size;
        of(owner).happened_.received.push_back(
            {message->topic, std::string(static_cast<const char*>(message->payload), kept),
             message->retain});
    }
};

Connection::Connection(const Settings& settings, const std::string& client_id, Protocol protocol)
    : settings_(settings),
      protocol_(protocol),
      session_(new_session(client_id, this), mosquitto_destroy) {}

Connection::~Connection() = default;

std::string Connection::set_up_tls() try {
    if (!settings_.tls) return "";
    client_ = std::make_unique<tls::ClientContext>(settings_.client(), settings_.host);
    mosquitto_log_callback_set(session_.get(), Callbacks::logged);
    mosquitto_int_option(session_.get(), MOSQ_OPT_SSL_CTX_WITH_DEFAULTS, 0);
    return why(mosquitto_void_option(session_.get(), MOSQ_OPT_SSL_CTX, client_->native()));
} catch (const tls::Unusable& unusable) {
    return unusable.what();
}

/// Counts a message; false beyond the rate, which holds for all who publish.
bool Connection::has_turn() {
    if (now_ - second_ >= 1s) {
        second_ = now_;
        in_second_ = 0;
    }
    if (in_second_ == settings_.messages) {
        ++happened_.left_out;
        return false;
    }
    ++in_second_;
    return true;
}

std::string Connection::reason(int code) const {
    if (code != MOSQ_ERR_SUCCESS && !ended_.empty()) return "the broker ends it: " + ended_;
    if (code == MOSQ_ERR_SUCCESS || !client_) return why(code);
    if (!client_->refusal().empty())
        return "TLS: " + client_->refusal() + " (`tls: ca` names who may sign it)";
    if (!tls_error_.empty()) return "TLS: the broker ends it: " + tls_error_;
    const bool is_reset = errno == EPROTO || errno == EPIPE || errno == ECONNRESET;
    return code == MOSQ_ERR_ERRNO && is_reset ? kClosed : why(code);
}

std::string Connection::set_up(const Message& will) {
    mosquitto* session = session_.get();
    mosquitto_connect_callback_set(session, Callbacks::connected);
    mosquitto_disconnect_callback_set(session, Callbacks::disconnected);
    mosquitto_subscribe_callback_set(session, Callbacks::subscribed);
    mosquitto_publish_callback_set(session, Callbacks::delivered);
    mosquitto_unsubscribe_callback_set(session, Callbacks::delivered);
    mosquitto_message_callback_set(session, Callbacks::received);
    mosquitto_int_option(session, MOSQ_OPT_TCP_NODELAY, 1);
    mosquitto_int_option(session, MOSQ_OPT_PROTOCOL_VERSION,
                         protocol_ == Protocol::mqtt5 ? MQTT_PROTOCOL_V5 : MQTT_PROTOCOL_V311);
    // The publisher enforces the limit; one more is for the farewell.
    mosquitto_max_inflight_messages_set(session, static_cast<unsigned>(settings_.in_flight) + 1);
    int code =
        mosquitto_will_set(session, will.topic.c_str(), static_cast<int>(will.payload.size()),
                           will.payload.data(), will.qos, will.retain);
    if (code == MOSQ_ERR_SUCCESS && !settings_.username.empty())
        code = mosquitto_username_pw_set(session, settings_.username.c_str(),
                                         or_null(settings_.password));
    if (code != MOSQ_ERR_SUCCESS) return why(code);
    return set_up_tls();
}

std::string Connection::connect(const Message& will) {
    std::string failed = set_up(will);
    if (!failed.empty()) return failed;
    const auto keep_alive = std::chrono::floor<std::chrono::seconds>(settings_.keep_alive).count();
    mosquitto_property* limit = nullptr;
    if (protocol_ == Protocol::mqtt5)
        mosquitto_property_add_int32(&limit, MQTT_PROP_MAXIMUM_PACKET_SIZE,
                                     static_cast<std::uint32_t>(settings_.packet));
    const int code =
        mosquitto_connect_bind_v5(session_.get(), settings_.host.c_str(), settings_.port,
                                  static_cast<int>(keep_alive), nullptr, limit);
    std::string why = reason(code);  // while errno is that of the call
    mosquitto_property_free_all(&limit);
    return why;
}

int Connection::socket() const { return mosquitto_socket(session_.get()); }

bool Connection::wants_write() const { return mosquitto_want_write(session_.get()); }

/// Reads until nothing is left: TLS may buffer data that the socket no longer signals.
std::string Connection::read(TimePoint now) {
    now_ = now;
    for (int i = 0; i < kReads; ++i) {
        errno = 0;
        const int code = mosquitto_loop_read(session_.get(), 1);
        if (code != MOSQ_ERR_SUCCESS) return reason(code);
        if (socket() < 0) return reason(MOSQ_ERR_CONN_LOST);  // a DISCONNECT is a success
        if (errno == EAGAIN || errno == EWOULDBLOCK) break;
    }
    return "";
}

std::string Connection::write() { return reason(mosquitto_loop_write(session_.get(), 1)); }

std::string Connection::housekeep() { return reason(mosquitto_loop_misc(session_.get())); }

int Connection::publish(const Message& message) {
    int id = 0;
    const int code = mosquitto_publish(session_.get(), &id, message.topic.c_str(),
                                       static_cast<int>(message.payload.size()),
                                       message.payload.data(), message.qos, message.retain);
    failed_ = why(code);
    return code == MOSQ_ERR_SUCCESS ? id : 0;
}

void Connection::subscribe(const std::string& filter) {
    int id = 0;
    // A broker of MQTT 5 then tells a message that was published as retained from another one.
    const int options = protocol_ == Protocol::mqtt5 ? MQTT_SUB_OPT_RETAIN_AS_PUBLISHED : 0;
    if (mosquitto_subscribe_v5(session_.get(), &id, filter.c_str(), 0, options, nullptr) ==
        MOSQ_ERR_SUCCESS)
        asked_[id] = filter;
}

int Connection::barrier() {
    int id = 0;
    const int code = mosquitto_unsubscribe(session_.get(), &id, kNothing);
    return code == MOSQ_ERR_SUCCESS ? id : 0;
}

void Connection::disconnect() { mosquitto_disconnect(session_.get()); }

Connection::Happened Connection::take() { return std::exchange(happened_, {}); }

}  // namespace panelgate::mqtt
