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

/// Bytes that are no request: counted, not answered.
struct Discarded {};
/// Nothing good will come of this connection: it is to be closed. Told once, and last.
struct Unusable {
    std::string reason;
    rt::LogLevel level = rt::LogLevel::info;
};
/// What the bytes of a client come to. A request without a transaction id has 0.
using ReaderEvent = std::variant<modbus::Adu, Discarded, Unusable>;

/// The seam between connections and framings: bytes in, requests out. One for each connection; it
/// knows no socket. Replies are written by modbus::encode_reply(). Take with next() until it gives
/// nothing before feeding more: then it holds one unfinished request at most. Pure.
class RequestReader {
  public:
    virtual ~RequestReader() = default;

    virtual void feed(TimePoint now, ByteView bytes) = 0;
    virtual std::optional<ReaderEvent> next(TimePoint now) = 0;
    /// A request has begun and is not whole.
    virtual bool partial() const = 0;
    /// When time alone changes something: on_due() then, and next() may give more.
    virtual std::optional<TimePoint> due() const = 0;
    virtual void on_due(TimePoint now) = 0;
    /// The client has said all: next() may give what only a silence would have ended.
    virtual void on_end() {}
    /// Nobody reads what the client sends: how long it takes is not its fault. Until next().
    virtual void pause() = 0;
};

/// As settings.framing says.
std::unique_ptr<RequestReader> make_request_reader(const Settings& settings);

/// "Modbus RTU"
std::string_view name_of(modbus::Framing framing);

/// Watches the first bytes of a connection for a client that speaks in another framing, or HTTP,
/// until its first request has been understood. Keeps no more of them than the longest ADU has.
/// Pure.
class FirstBytes {
  public:
    explicit FirstBytes(modbus::Framing expected) : expected_(expected) {}

    void feed(ByteView bytes);
    void on_request();
    /// Why the connection is of no use here; told once.
    std::optional<Unusable> take_objection();

  private:
    modbus::Framing expected_;
    bool watching_ = true;
    Bytes bytes_;
    std::optional<std::string> objection_;
};

}  // namespace panelgate::tcp_server
