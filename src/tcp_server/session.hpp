#pragma once

#include <array>
#include <boost/asio/ip/address.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/rt/settings.hpp"
#include "panelgate/tcp_server/dispatch.hpp"
#include "panelgate/tls/stream.hpp"
#include "pipeline.hpp"
#include "places.hpp"
#include "request_reader.hpp"
#include "shared.hpp"

namespace panelgate::tcp_server {

/// One client connection. Its listener keeps it alive until `on_closed`, pending operations a
/// little longer. At most one read and one write at a time. Its memory is bounded: the requests of
/// its pipeline with their replies, and one read buffer.
class Session : public std::enable_shared_from_this<Session> {
  public:
    using ClosedHandler = std::function<void(const std::shared_ptr<Session>&)>;

    /// With TLS the handshake is over.
    Session(tls::Stream stream, std::shared_ptr<Shared> shared, ClosedHandler on_closed);

    void start(Caller caller);
    /// Returns the peer's address; for a closed connection, the unspecified address, which no allow
    /// list admits.
    boost::asio::ip::address peer() const;
    /// Returns its name in logs.
    const std::string& client() const { return pipeline_->client(); }
    /// Returns what its place depends on. It is idle unless requests or replies are outstanding, or
    /// a half-sent ADU still goes on.
    Guest guest() const;
    /// Takes no more requests, answers those in flight, refuses queued ones, then closes.
    void finish();
    /// Closes at once, because of what its certificate no longer allows; logged.
    void dismiss(const std::string& why);
    const tls::Stream& stream() const { return stream_; }
    /// Closes at once and cancels its queued requests on the buses. Idempotent.
    void close();

  private:
    /// How input is handled.
    enum class Input : std::uint8_t {
        served,
        discarded,  ///< the session closes after the last reply
        ended,      ///< the same, after end of input
    };

    void take_certificate();
    void go_on();
    void read();
    void on_read(const boost::system::error_code& error, std::size_t size);
    void on_read_error(const boost::system::error_code& error);
    void on_end_of_input();
    void watch_for_reset();
    void take_requests();
    void watch_reader();
    void on_due();
    void cancel_due();
    void write();
    void write_later(ByteView rest);
    void on_written(const boost::system::error_code& error);
    void watch_output();
    int unacknowledged_bytes();
    void fail(std::string_view reason, rt::LogLevel level = rt::LogLevel::info);

    tls::Stream stream_;
    std::shared_ptr<Shared> shared_;
    ClosedHandler on_closed_;
    std::shared_ptr<Pipeline> pipeline_;
    std::uint64_t host_{};  ///< of its address
    TimePoint active_;      ///< its last input

    Input input_state_ = Input::served;
    std::array<std::uint8_t, 4096> input_{};
    bool reading_ = false;
    bool watching_for_reset_ = false;
    /// Holds at most one incomplete request whenever a read starts.
    std::unique_ptr<RequestReader> reader_;
    std::unique_ptr<rt::Alarm> due_alarm_;
    std::optional<TimePoint> due_;  ///< the alarm is armed
    bool looked_again_ = false;     ///< on_due() has, at encrypted bytes

    bool writing_ = false;       ///< the rest of the pipeline's front() is being written
    std::uint64_t written_ = 0;  ///< replies
    std::unique_ptr<rt::Alarm> output_alarm_;
    bool watching_output_ = false;
    bool closed_ = false;
};

}  // namespace panelgate::tcp_server
