#include "session.hpp"

#include <linux/sockios.h>
#include <sys/ioctl.h>

#include <boost/asio/bind_allocator.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/write.hpp>
#include <cstddef>
#include <utility>
#include <variant>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/pool.hpp"
#include "panelgate/tls/peer.hpp"

namespace panelgate::tcp_server {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

constexpr Duration kAnotherLook = 20ms;

}  // namespace

Session::Session(tls::Stream stream, std::shared_ptr<Shared> shared, ClosedHandler on_closed)
    : stream_(std::move(stream)),
      shared_(std::move(shared)),
      on_closed_(std::move(on_closed)),
      active_(shared_->clock.now()),
      reader_(make_request_reader(shared_->settings)),
      due_alarm_(shared_->clock.make_alarm()),
      output_alarm_(shared_->clock.make_alarm()) {}

void Session::start(Caller caller) {
    host_ = caller.host();
    pipeline_ = std::make_shared<Pipeline>(shared_, std::move(caller), [weak = weak_from_this()] {
        if (const auto self = weak.lock()) self->go_on();
    });
    if (stream_.is_secure()) take_certificate();
    read();
}

void Session::take_certificate() {
    const tls::Peer& peer = stream_.peer();
    const auto role = tls::certified_role(shared_->settings.tls, peer);
    if (role && !role->doubt.empty())
        shared_->log(
            rt::LogLevel::warn, "certificate without a role",
            {{"client", pipeline_->client()}, {"subject", peer.subject}, {"reason", role->doubt}});
    pipeline_->certify(peer.subject, role ? std::optional(role->word) : std::nullopt);
}

Guest Session::guest() const {
    const bool half_sent =
        due_ && shared_->clock.now() - active_ < shared_->settings.half_sent_pause;
    return {host_, pipeline_->empty() && !writing_ && !half_sent, active_};
}

asio::ip::address Session::peer() const {
    error_code gone;
    return stream_.socket().remote_endpoint(gone).address();
}

/// Refuses queued requests; otherwise a pipelining client could delay the end indefinitely.
void Session::finish() {
    if (closed_) return;
    if (input_state_ == Input::served) input_state_ = Input::discarded;
    cancel_due();
    pipeline_->refuse_waiting();
    go_on();
}

void Session::dismiss(const std::string& why) {
    if (!closed_) fail(why, rt::LogLevel::warn);
}

void Session::close() {
    if (std::exchange(closed_, true)) return;
    const std::shared_ptr<Session> self = shared_from_this();
    stream_.close();
    due_alarm_->cancel();
    output_alarm_->cancel();
    pipeline_->close();
    if (const ClosedHandler handler = std::exchange(on_closed_, nullptr)) handler(self);
}

void Session::fail(std::string_view reason, rt::LogLevel level) {
    shared_->log(level, "connection closed",
                 {{"client", pipeline_->client()}, {"reason", std::string(reason)}});
    close();
}

/// Runs after every event: takes requests as far as there is room, sends ready replies, reads on.
void Session::go_on() {
    if (closed_) return;
    if (input_state_ == Input::served) take_requests();
    write();
    read();
}

// Input. Without room the session stops reading and TCP slows the client down. Input received while
// finishing is discarded: closing a socket with unread input would reset replies in transit.

void Session::read() {
    if (closed_ || reading_ || input_state_ == Input::ended) return;
    if (input_state_ == Input::served && !pipeline_->has_room()) return watch_for_reset();
    reading_ = true;
    auto handler = [self = shared_from_this()](const error_code& error, std::size_t size) {
        self->on_read(error, size);
    };
    auto pooled = asio::bind_allocator(PoolAllocator<std::byte>(), std::move(handler));
    stream_.read_some(asio::buffer(input_), std::move(pooled));
}

void Session::on_read(const error_code& error, std::size_t size) {
    reading_ = false;
    if (closed_) return;
    if (error) return on_read_error(error);
    active_ = shared_->clock.now();
    if (input_state_ == Input::served)
        reader_->feed(shared_->clock.now(), ByteView(input_.data(), size));
    go_on();
}

void Session::on_read_error(const error_code& error) {
    if (error == asio::error::eof) return on_end_of_input();
    if (error != tls::kDamaged) return close();
    ++shared_->counters.protocol_errors;
    fail("its bytes are no TLS, or were changed on the way");
}

/// Takes complete requests from the reader as far as there is room.
void Session::take_requests() {
    const TimePoint now = shared_->clock.now();
    while (pipeline_->has_room()) {
        auto event = reader_->next(now);
        if (!event) break;
        if (auto* adu = std::get_if<modbus::Adu>(&*event)) {
            pipeline_->take(std::move(*adu));
            continue;
        }
        ++shared_->counters.protocol_errors;
        if (const auto* end = std::get_if<Unusable>(&*event)) return fail(end->reason, end->level);
    }
    watch_reader();
}

/// The reader's timeout runs only while the client can send more.
void Session::watch_reader() {
    if (!pipeline_->has_room()) reader_->pause();
    const auto due = pipeline_->has_room() ? reader_->due() : std::nullopt;
    if (due == due_) return;
    cancel_due();
    if (!due) return;
    due_ = due;
    due_alarm_->arm(*due, [self = shared_from_this()] { self->on_due(); });
}

/// Bytes already in the socket arrived in time even if not read yet. What is there after another
/// turn of the loop is a part of a TLS record.
void Session::on_due() {
    due_.reset();
    if (reading_ && stream_.available() != 0) {
        if (!stream_.is_secure()) return;  // take_requests() looks again
        if (!std::exchange(looked_again_, true)) {
            due_ = shared_->clock.now() + kAnotherLook;
            due_alarm_->arm(*due_, [self = shared_from_this()] { self->on_due(); });
            return;
        }
    }
    looked_again_ = false;
    reader_->on_due(shared_->clock.now());
    go_on();
}

void Session::cancel_due() {
    if (std::exchange(due_, std::nullopt)) due_alarm_->cancel();
}

/// A client that has only half-closed still reads and gets its replies. One that is gone looks the
/// same until it answers the first reply with a reset (P2).
void Session::on_end_of_input() {
    if (input_state_ == Input::served) {
        reader_->on_end();
        take_requests();
        if (closed_) return;
    }
    const bool cut_off = input_state_ == Input::served && reader_->partial();
    if (cut_off) ++shared_->counters.protocol_errors;
    input_state_ = Input::ended;
    cancel_due();
    watch_for_reset();
    write();
}

/// Detects a reset while the session does not read (no room, or end of input); outstanding replies
/// are abandoned then.
void Session::watch_for_reset() {
    if (std::exchange(watching_for_reset_, true)) return;
    stream_.socket().async_wait(asio::ip::tcp::socket::wait_error,
                                [self = shared_from_this()](const error_code&) { self->close(); });
}

// Output.

/// Usually the kernel accepts a reply at once; the rest is written asynchronously.
void Session::write() {
    if (closed_ || writing_) return;
    while (const Bytes* adu = pipeline_->front()) {
        error_code error;
        const std::size_t taken = stream_.write_some(asio::buffer(*adu), error);
        if (error && error != asio::error::would_block) return close();
        if (taken < adu->size()) return write_later(ByteView(*adu).subspan(taken));
        ++written_;
        pipeline_->pop();
        if (input_state_ == Input::served) take_requests();
        if (closed_) return;
    }
    if (input_state_ != Input::served && pipeline_->empty()) close();
}

void Session::write_later(ByteView rest) {
    writing_ = true;
    watch_output();
    asio::async_write(stream_, asio::buffer(rest.data(), rest.size()),
                      [self = shared_from_this()](const error_code& error, std::size_t) {
                          self->on_written(error);
                      });
}

void Session::on_written(const error_code& error) {
    writing_ = false;
    if (closed_) return;
    if (error) return close();
    ++written_;
    pipeline_->pop();
    go_on();
}

/// Closes a client that takes nothing for output_timeout (up to twice that: one alarm per period,
/// not per reply). A slow client may stay: bytes acknowledged by its TCP stack count as taken.
void Session::watch_output() {
    if (std::exchange(watching_output_, true)) return;
    output_alarm_->arm(
        shared_->clock.now() + shared_->settings.output_timeout,
        [self = shared_from_this(), written = written_, held = unacknowledged_bytes()] {
            self->watching_output_ = false;
            if (!self->writing_) return;
            if (self->written_ == written && self->unacknowledged_bytes() == held) {
                return self->fail("client does not read");
            }
            self->watch_output();
        });
}

/// Returns the bytes of replies not acknowledged by the client's TCP stack.
int Session::unacknowledged_bytes() {
    int bytes = 0;
    if (::ioctl(stream_.socket().native_handle(), SIOCOUTQ, &bytes) != 0) return 0;
    return bytes;
}

}  // namespace panelgate::tcp_server
