#pragma once

#include <cstdint>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/scan/result.hpp"

namespace panelgate::scan {

/// Maximum bytes kept while listening; the rest is dropped.
inline constexpr std::size_t kMaxHeard = 4096;

struct Frame {
    std::uint8_t station = 0;
    Bytes pdu;
    modbus::CrcOrder crc_order = modbus::CrcOrder::low_first;
};

struct Heard {
    std::vector<Frame> frames;
    std::size_t damaged = 0;  ///< bytes outside of frames
};

/// Extracts valid frames, requests and replies, at any position and in either CRC order. Standard
/// functions only: by chance noise forms a frame at less than one of 50 000 positions.
Heard extract_frames(ByteView bytes);

struct ReplyTimeouts {
    Duration start{};   ///< from the end of the request to the first byte of its reply
    Duration settle{};  ///< after a good reply
};

/// Result of one request.
struct Outcome {
    enum class Kind : std::uint8_t { silent, replied, damaged };
    Kind kind = Kind::silent;
    Bytes reply;        ///< PDU
    unsigned more = 0;  ///< further replies to the same request
    bool header_seen =
        false;  ///< the damaged bytes contain address and function: unlikely for noise
    bool with_damage = false;        ///< damaged bytes in addition to a good reply
    std::vector<Frame> unsolicited;  ///< valid frames that do not answer the request
};

/// One request on the wire and everything heard until the next. Removes the adapter's echo of the
/// request.
class Attempt {
  public:
    Attempt(ReadRequest request, const SerialFormat& format, TimePoint sent,
            ReplyTimeouts timeouts);

    const ReadRequest& request() const { return request_; }
    void on_rx(TimePoint now, ByteView bytes);
    /// Returns when to stop waiting, as far as is known now.
    TimePoint ends_at() const;
    Outcome finish() const;

  private:
    ByteView without_echo() const;
    bool contains_header(ByteView bytes) const;

    ReadRequest request_;
    TimePoint start_by_;
    TimePoint latest_;  ///< continuous noise must not delay the scan
    Duration settle_;
    Duration gap_;  ///< silence that ends an incomplete reply
    TimePoint last_rx_{};
    Bytes heard_;
    bool replied_ = false;
    bool header_seen_ = false;  ///< a damaged reply: no other is expected
};

}  // namespace panelgate::scan
