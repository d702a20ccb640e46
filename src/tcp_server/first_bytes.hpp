#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/framing.hpp"
#include "request_reader.hpp"

namespace panelgate::tcp_server {

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
