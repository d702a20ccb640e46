#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/framing.hpp"

namespace panelgate::line {

/// Turns RTU frames into ADUs of Modbus/TCP and back, so that a device on Ethernet is asked as a
/// line is: one request at a time. A reply counts if its transaction id is that of the last
/// request; all others come too late. Pure.
class Mbap {
  public:
    /// Bytes that replies() may be given at once: with what waits the frames fit into 1024 bytes.
    static constexpr std::size_t kRead = 512;

    /// The ADU for a frame: address, PDU and CRC.
    Bytes request(ByteView frame);
    /// Takes what was received; returns the frames of replies that count. Nothing: the bytes are no
    /// Modbus/TCP, and the connection must be closed.
    std::optional<Bytes> replies(ByteView received);
    /// A new connection begins.
    void restart() {
        framer_ = {};
        waits_ = false;
    }

  private:
    modbus::MbapFramer framer_;
    std::uint16_t id_ = 0;   ///< of the last request
    std::uint8_t unit_ = 0;  ///< the same
    bool waits_ = false;     ///< for a reply to the last request
};

}  // namespace panelgate::line
