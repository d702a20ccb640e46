#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/framing.hpp"
#include "panelgate/rt/settings.hpp"
#include "panelgate/tcp_server/settings.hpp"

namespace panelgate::tcp_server {

/// Bytes that form no request: counted, not answered.
struct Discarded {};
/// The connection must be closed. The last event, returned once.
struct Unusable {
    std::string reason;
    rt::LogLevel level = rt::LogLevel::info;
};
/// What a reader makes of a client's bytes. A request without a transaction id has 0.
using ReaderEvent = std::variant<modbus::Adu, Discarded, Unusable>;

/// Interface between connections and framings: bytes in, requests out. One per connection,
/// independent of the socket. modbus::encode_reply() writes the replies. Call next() until it
/// returns nothing before feeding more: then it holds at most one incomplete request. Pure.
class RequestReader {
  public:
    virtual ~RequestReader() = default;

    virtual void feed(TimePoint now, ByteView bytes) = 0;
    virtual std::optional<ReaderEvent> next(TimePoint now) = 0;
    /// True while a request is incomplete.
    virtual bool partial() const = 0;
    /// Time at which on_due() must be called; next() may then return more.
    virtual std::optional<TimePoint> due() const = 0;
    virtual void on_due(TimePoint now) = 0;
    /// End of input: next() may return a frame that only a silence would have ended.
    virtual void on_end() {}
    /// The session has stopped reading: timeouts do not run until next().
    virtual void pause() = 0;
};

/// Creates the reader for settings.framing.
std::unique_ptr<RequestReader> make_request_reader(const Settings& settings);

/// Returns a display name such as "Modbus RTU".
std::string_view name_of(modbus::Framing framing);

/// Detects from a connection's first bytes a client that uses another framing, or HTTP, until its
/// first valid request. Keeps at most the length of the longest ADU. Pure.
class FirstBytes {
  public:
    explicit FirstBytes(modbus::Framing expected) : expected_(expected) {}

    void feed(ByteView bytes);
    void on_request();
    /// Returns, once, why the connection is unusable.
    std::optional<Unusable> take_objection();

  private:
    modbus::Framing expected_;
    bool watching_ = true;
    Bytes bytes_;
    std::optional<std::string> objection_;
};

}  // namespace panelgate::tcp_server
