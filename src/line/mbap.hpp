#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "panelgate/base/bytes.hpp"

namespace panelgate::line {

/// Turns frames of RTU into ADUs of Modbus/TCP and back (Messaging on TCP/IP V1.0b, 3.1), so that a
/// device on Ethernet is asked as a line is: one request at a time. A reply counts if its
/// transaction id is that of the last request; all others come too late. Pure.
class Mbap {
  public:
    static constexpr std::size_t kHeader = 7;  ///< bytes in front of the PDU: id, 0, length, unit
    static constexpr std::size_t kLargest = 260;  ///< bytes of an ADU
    /// What replies() may be given at once, so that its frames fit into kRead + kLargest bytes.
    static constexpr std::size_t kRead = 512;

    /// The ADU for a frame: address, PDU and CRC.
    Bytes request(ByteView frame);
    /// Takes what was received; returns the frames of replies that count. Nothing: the bytes are no
    /// Modbus/TCP, and the connection must be closed.
    std::optional<Bytes> replies(ByteView received);
    /// A new connection begins.
    void restart();

  private:
    std::uint16_t id_ = 0;  ///< of the last request
    std::uint8_t unit_ = 0;
    bool waits_ = false;  ///< for a reply to the last request
    Bytes partial_;       ///< the beginning of an ADU
};

}  // namespace panelgate::line
