#include "panelgate/tls/handshakes.hpp"

#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509_vfy.h>
#include <sys/socket.h>
#include <algorithm>
#include <array>
#include <boost/asio/ssl/error.hpp>
#include <cctype>
#include <cerrno>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "native.hpp"
#include "panelgate/base/network.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::tls {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr char kHandshakeRecord = 22;  // RFC 8446 5.1

std::string spoken(std::string_view first) {
    const std::size_t word = first.find(' ');
    const bool is_method = word != first.npos && word > 2 &&
                           std::ranges::all_of(first.substr(0, word), [](unsigned char c) {
                               return std::isupper(c) != 0;
                           });
    if (is_method) return "it speaks HTTP without TLS; write https:// in its address";
    if (first.size() > 5 && first.substr(2, 3) == std::string_view("\0\0\0", 3))
        return "it speaks Modbus/TCP without TLS; give it TLS, or a listener without tls";
    return "it does not speak TLS; give it TLS, or a listener without tls";
}

struct Explained {
    int reason;
    Outcome outcome;
    const char* text;
};

constexpr const char* kNotTaken =
    "the client does not take the gateway's certificate; give the client the certificate of the CA "
    "that signed it";
constexpr const char* kVersions =
    "the client speaks no version that is allowed: TLS 1.3, and TLS 1.2 with AEAD suites unless "
    "`min_version` rules it out";

constexpr Explained kExplained[] = {
    {SSL_R_PEER_DID_NOT_RETURN_A_CERTIFICATE, Outcome::no_certificate,
     "the client shows no certificate; give it one that the CA of `ca` signed"},
    {SSL_R_UNSUPPORTED_PROTOCOL, Outcome::version, kVersions},
    {SSL_R_VERSION_TOO_LOW, Outcome::version, kVersions},
    {SSL_R_TLSV1_ALERT_PROTOCOL_VERSION, Outcome::version, kVersions},
    {SSL_R_NO_SHARED_CIPHER, Outcome::version,
     "the client offers no cipher suite that is allowed; ECDHE with AES-GCM or ChaCha20 is"},
    {SSL_R_WRONG_VERSION_NUMBER, Outcome::broken, "the client's bytes are no TLS"},
    {SSL_R_TLSV1_ALERT_UNKNOWN_CA, Outcome::refused, kNotTaken},
    {SSL_R_SSLV3_ALERT_BAD_CERTIFICATE, Outcome::refused, kNotTaken},
    {SSL_R_SSLV3_ALERT_CERTIFICATE_UNKNOWN, Outcome::refused, kNotTaken},
    {SSL_R_SSLV3_ALERT_UNSUPPORTED_CERTIFICATE, Outcome::refused, kNotTaken},
    {SSL_R_SSLV3_ALERT_CERTIFICATE_REVOKED, Outcome::refused, kNotTaken},
    {SSL_R_SSLV3_ALERT_CERTIFICATE_EXPIRED, Outcome::refused,
     "the client says that the gateway's certificate has expired"},
    {SSL_R_TLSV1_ALERT_ACCESS_DENIED, Outcome::refused, "the client ended it"},
    {SSL_R_SSLV3_ALERT_HANDSHAKE_FAILURE, Outcome::refused, "the client ended it"},
};

/// Of a handshake whose certificates are not to blame.
Refusal explained(const error_code& error) {
    if (error.category() != asio::error::get_ssl_category())
        return {Outcome::broken, "the client left during the handshake"};
    const int reason = ERR_GET_REASON(static_cast<unsigned long>(error.value()));
    const auto* const found = std::ranges::find(kExplained, reason, &Explained::reason);
    if (found != std::end(kExplained)) return {found->outcome, found->text};
    return {Outcome::broken, error.message()};
}

/// "the CA CN=Plant CA of the client's certificate CN=panel has expired".
std::string sentence_of(X509_STORE_CTX* judging, int why) {
    const X509* const own = X509_STORE_CTX_get0_cert(judging);
    const X509* const judged = X509_STORE_CTX_get_current_cert(judging);
    std::string text = "the client's certificate " + subject_of(own) + ' ';
    if (judged != nullptr && X509_cmp(judged, own) != 0)
        text = "the CA " + subject_of(judged) + " of " + text;
    if (why == X509_V_ERR_INVALID_PURPOSE)
        return text +
               "is not one of a client; its extended key usage must have clientAuth, and "
               "its key usage, if it has one, digitalSignature";
    return text + words_of_chain(why);
}

/// Judges one certificate of a chain. An overdue list of revoked certificates still counts, and a
/// CA between the client and the root needs no list.
bool judge_chain(bool good, X509_STORE_CTX* judging, Refusal& refusal) {
    if (good) return true;
    const int why = X509_STORE_CTX_get_error(judging);
    if (why == X509_V_ERR_CRL_HAS_EXPIRED ||
        (why == X509_V_ERR_UNABLE_TO_GET_CRL && X509_STORE_CTX_get_error_depth(judging) > 0)) {
        X509_STORE_CTX_set_error(judging, X509_V_OK);
        return true;
    }
    refusal = {outcome_of_chain(why), sentence_of(judging, why)};
    return false;
}

rt::LogLevel level_of(Outcome outcome) {
    const bool is_passing =
        outcome == Outcome::broken || outcome == Outcome::timeout || outcome == Outcome::displaced;
    return is_passing ? rt::LogLevel::info : rt::LogLevel::warn;
}

std::shared_ptr<const Context> context_of(const Settings& settings) {
    return settings.made ? settings.made : std::make_shared<const Context>(settings);
}

}  // namespace

/// One handshake. Its pending operations keep it.
struct Handshakes::Conversation {
    Conversation(tcp::socket socket, const tcp::endpoint& peer, Done done)
        : host(peer.address().to_string()),
          client(endpoint_text(peer.address().to_string(), peer.port())),
          done(std::move(done)),
          plain(std::move(socket)),
          deadline(plain.get_executor()) {}

    const HostKey host;
    const std::string client;
    Done done;  ///< null: the handshake has ended
    tcp::socket plain;
    std::unique_ptr<Stream::Secure> secure{};  ///< from its turn on
    asio::steady_timer deadline;
    bool waits_for_turn = false;
    std::shared_ptr<Refusal> refusal = std::make_shared<Refusal>();  ///< "": none of a certificate
};

Handshakes::Handshakes(asio::any_io_executor executor, std::string name, Settings settings)
    : name_(std::move(name)),
      settings_(std::move(settings)),
      context_(context_of(settings_)),
      turn_(std::move(executor)) {}

Handshakes::~Handshakes() = default;

void Handshakes::apply(const Settings& settings) try {
    if (settings == settings_) return;
    context_ = context_of(settings);
    settings_ = settings;
} catch (const Unusable& why) {
    rt::log(rt::LogLevel::error, "certificate not renewed",
            {{"listener", name_}, {"reason", why.what()}});
}

void Handshakes::begin(tcp::socket socket, Done done) {
    error_code gone;
    const tcp::endpoint peer = socket.remote_endpoint(gone);
    if (gone) return;
    const auto one = std::make_shared<Conversation>(std::move(socket), peer, std::move(done));
    make_room(one->host);
    running_.push_back(one);
    one->deadline.expires_after(settings_.handshake_timeout);
    one->deadline.async_wait(
        [weak = weak_from_this(), one = std::weak_ptr(one)](const error_code& cancelled) {
            const auto self = weak.lock();
            const auto late = one.lock();
            if (self && late && !cancelled)
                self->fail(late, Outcome::timeout, "the handshake took too long");
        });
    listen(one);
}

/// Who waits for the client's bytes gives way before who waits for a turn: half handshakes of many
/// addresses would else take the place of a newcomer.
void Handshakes::make_room(const HostKey& host) {
    std::map<HostKey, std::size_t> counts;
    for (const Ref& one : running_) ++counts[one->host];
    std::size_t crowd = counts[host];
    const bool share_used = crowd >= settings_.max_handshakes_per_address;
    if (!share_used && running_.size() < settings_.max_handshakes) return;
    if (!share_used)
        for (const auto& [_, count] : counts) crowd = std::max(crowd, count);
    const auto may_go = [&](const Ref& one) {
        return share_used ? one->host == host : counts[one->host] == crowd;
    };
    auto first = std::ranges::find_if(
        running_, [&](const Ref& one) { return may_go(one) && !one->waits_for_turn; });
    if (first == running_.end()) first = std::ranges::find_if(running_, may_go);
    fail(Ref(*first), Outcome::displaced,
         "too many handshakes at the same time; the oldest gives way");
}

void Handshakes::listen(const Ref& one) {
    one->plain.async_wait(tcp::socket::wait_read,
                          [self = shared_from_this(), one](const error_code& error) {
                              if (one->done && !error) self->look(one);
                          });
}

/// The first bytes of TLS stay in the socket. Other bytes are read, so that closing is no reset.
void Handshakes::look(const Ref& one) {
    std::array<char, 4096> first;
    const int socket = one->plain.native_handle();
    const auto size = ::recv(socket, first.data(), 1, MSG_PEEK | MSG_DONTWAIT);
    if (size < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return listen(one);
    if (size <= 0) return fail(one, Outcome::broken, "the client left before the first byte");
    if (first[0] != kHandshakeRecord) {
        const auto all = ::recv(socket, first.data(), first.size(), MSG_DONTWAIT);
        return fail(one, Outcome::plain,
                    spoken({first.data(), static_cast<std::size_t>(std::max(all, ssize_t{1}))}));
    }
    one->waits_for_turn = true;
    take_turns();
}

void Handshakes::take_turns() {
    const auto next =
        std::ranges::find_if(running_, [](const Ref& one) { return one->waits_for_turn; });
    if (turn_is_armed_ || next == running_.end()) return;
    const Ref one = *next;
    one->waits_for_turn = false;
    turn_is_armed_ = true;
    turn_.expires_after(settings_.between_handshakes);
    turn_.async_wait([weak = weak_from_this()](const error_code&) {
        const auto self = weak.lock();
        if (!self) return;
        self->turn_is_armed_ = false;
        self->take_turns();
    });
    shake(one);
}

void Handshakes::shake(const Ref& one) {
    one->secure =
        std::make_unique<Stream::Secure>(std::move(one->plain), SSL_new(context_->native()));
    one->secure->set_verify_callback(
        [refusal = one->refusal](bool good, asio::ssl::verify_context& judging) {
            return judge_chain(good, judging.native_handle(), *refusal);
        });
    one->secure->async_handshake(asio::ssl::stream_base::server,
                                 [self = shared_from_this(), one](const error_code& error) {
                                     if (one->done) self->judge(one, error);
                                 });
}

void Handshakes::judge(const Ref& one, const error_code& error) {
    if (error) {
        const Refusal refusal = one->refusal->why.empty() ? explained(error) : *one->refusal;
        return fail(one, refusal.outcome, refusal.why);
    }
    Stream stream(std::move(one->secure));
    // The settings may have changed meanwhile.
    if (const std::string why = why_leave(stream); !why.empty())
        return fail(one, Outcome::revoked, why);
    const Done done = one->done;
    end(one, Outcome::done);
    done(std::move(stream));
}

void Handshakes::fail(const Ref& one, Outcome outcome, const std::string& why) {
    if (!end(one, outcome)) return;
    const std::string& client = one->client;
    const std::string subject = name_ + ' ' + one->host.text() + ' ' + why;
    rt::log_about(subject, level_of(outcome), "tls handshake failed",
                  {{"listener", name_},
                   {"client", client},
                   {"outcome", std::string(label(outcome))},
                   {"reason", why}});
}

/// False if the handshake has ended before.
bool Handshakes::end(const Ref& one, Outcome outcome) {
    if (!std::exchange(one->done, nullptr)) return false;
    ++counters_.handshakes[static_cast<std::size_t>(outcome)];
    const Ref kept = one;
    running_.remove(one);
    kept->deadline.cancel();
    error_code ignored;
    kept->plain.close(ignored);
    if (kept->secure) kept->secure->next_layer().close(ignored);
    return true;
}

std::string Handshakes::why_leave(const Stream& stream) const {
    if (settings_.client == ClientCertificate::none) return "";
    x509_st* const shown = stream.certificate();
    if (shown == nullptr)
        return settings_.client == ClientCertificate::required
                   ? "the client has shown no certificate, and now must"
                   : "";
    const std::string what = "the client's certificate " + stream.peer().subject;
    if (context_->revokes(shown)) return what + " is revoked";
    const auto now = static_cast<std::int64_t>(rt::wall_seconds());
    if (now < stream.peer().expiry) return "";
    const bool is_own = seconds_of(X509_get0_notAfter(shown)) <= now;
    return (is_own ? what : "the CA of " + what) + " has expired";
}

void Handshakes::stop() {
    const std::list<Ref> all = running_;
    for (const Ref& one : all) fail(one, Outcome::displaced, "its listener ends");
}

Counters Handshakes::counters() const {
    Counters counters = counters_;
    counters.certificate_expiry = context_->expiry();
    return counters;
}

}  // namespace panelgate::tls
