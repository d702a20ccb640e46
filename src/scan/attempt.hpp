#pragma once

#include <cstdint>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/scan/result.hpp"

namespace panelgate::scan {

/// What is kept of one listening at most; the rest is dropped.
inline constexpr std::size_t kMaxHeard = 4096;

struct Frame {
    std::uint8_t station = 0;
    Bytes pdu;
    modbus::CrcOrder crc_order = modbus::CrcOrder::low_first;
};

struct Heard {
    std::vector<Frame> frames;
    std::size_t damaged = 0;  ///< bytes in no frame
};

/// Good frames, requests as well as replies, wherever they begin, in either order of the CRC. Only
/// functions of the standard: chance makes a frame of noise in less than one of 50 000 places.
Heard take_apart(ByteView bytes);

struct Patience {
    Duration start{};   ///< from the end of the request to the first byte of its reply
    Duration settle{};  ///< after a good reply
};

/// What one request brought.
struct Outcome {
    enum class Kind : std::uint8_t { silent, replied, damaged };
    Kind kind = Kind::silent;
    Bytes reply;         ///< PDU
    unsigned more = 0;   ///< further replies to the same request
    bool begun = false;  ///< the damage holds the address and the function: noise hardly does
    bool torn = false;   ///< damaged bytes besides a good reply
    std::vector<Frame> strays;  ///< good frames that answer something else
};

/// One request on the wire and everything that is heard until the next. The adapter's echo of the
/// request is taken out.
class Attempt {
  public:
    Attempt(ReadRequest request, const SerialFormat& format, TimePoint sent, Patience patience);

    const ReadRequest& request() const { return request_; }
    void on_rx(TimePoint now, ByteView bytes);
    /// When no more is worth waiting for, as far as is known now.
    TimePoint ends_at() const;
    Outcome finish() const;

  private:
    ByteView without_echo() const;
    bool holds_beginning(ByteView bytes) const;

    ReadRequest request_;
    TimePoint start_by_;
    TimePoint latest_;  ///< babble must not hold up the scan
    Duration settle_;
    Duration gap_;  ///< silence that ends what is no whole reply
    TimePoint last_rx_{};
    Bytes heard_;
    bool replied_ = false;
    bool begun_ = false;  ///< a damaged reply: no other is to be expected
};

}  // namespace panelgate::scan
