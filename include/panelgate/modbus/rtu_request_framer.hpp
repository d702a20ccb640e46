#pragma once

#include <cstddef>
#include <optional>

#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/modbus/rtu_framer.hpp"

namespace panelgate::modbus {

/// Length of an RTU request (address to CRC), as far as its own first bytes determine it; the same
/// three kinds as for a reply. 08/0000 may carry any number of words and ends by silence, as do
/// functions that the standard does not define.
using RequestLength = ReplyLength;
RequestLength request_length(ByteView frame);
/// Like request_length(), but the length of 08/0000 with one word of data, the usual form, is known
/// once its CRC is correct.
RequestLength usual_request_length(ByteView frame);
/// Returns station and PDU of a valid RTU frame.
SerialAdu serial_adu_of(ByteView frame);

/// Finds requests in a client's stream, as a slave does, but without the silence around frames,
/// which a stream does not keep: function and header give the length, the CRC decides. Bytes that
/// begin no valid frame are skipped one by one. A start that still waits for bytes blocks the later
/// ones, or bytes inside a request could pass for one; silence discards it if a valid frame
/// follows, and ends requests without a length rule. A frame found after skipped bytes may be the
/// data of a damaged write: only pure reads are accepted there, anything else is a fault, and
/// functions without a length rule are not searched for. Frames are trusted again after silence,
/// and after more valid frames in a row than one damaged frame could hold; up to three skipped
/// bytes are a glitch, too short to be the head of a request with data. Call next() until it
/// returns std::nullopt before feeding more; then at most 256 bytes are buffered.
class RtuRequestFramer {
  public:
    void feed(ByteView bytes) { heard_.feed(bytes); }
    std::optional<SerialAdu> next();
    /// A silence on the line: next() may return more now.
    void on_silence();
    /// Discards pending bytes: their rest will not come.
    void drop_pending();

    /// True if bytes are pending: more bytes or silence will decide.
    bool partial() const { return !heard_.empty(); }
    /// Returns the bytes since the last valid frame that belong to none.
    std::size_t discarded() const { return discarded_; }
    /// Returns the number of faults since the last call: bytes skipped after a valid frame or a
    /// silence, and requests rejected among skipped bytes.
    std::size_t take_faults();

  private:
    struct Judgement {
        enum class Kind : std::uint8_t { frame, open, nothing };
        Kind kind = Kind::nothing;
        std::size_t size = 0;  ///< of a frame
    };
    Judgement judge(ByteView start) const;
    std::size_t size_by_silence() const;
    /// True if what begins at the front is no part of a damaged frame.
    bool sure() const { return trusted_ || since_lost_ <= glitch_limit_; }
    void clear_trust();
    void trust();
    SerialAdu take(std::size_t size);
    void refuse(std::size_t size);
    void step_over(std::size_t count);
    void consume(std::size_t count);
    void extend_run(std::size_t size);

    ByteQueue heard_;
    std::size_t ended_by_silence_ = 0;  ///< size of the frame at the front; 0: none
    bool aligned_ = true;               ///< a valid frame or a silence directly precedes the front
    bool trusted_ = true;               ///< ... and no damaged frame can surround them
    std::size_t since_lost_ = 0;        ///< bytes since trust was lost
    std::size_t glitch_limit_ = 0;      ///< so few of them cannot hide a request
    std::size_t run_length_ = 0;        ///< bytes of consecutive valid frames
    std::size_t bytes_to_silence_ = 0;  ///< bytes until a silence; 0: none
    std::size_t discarded_ = 0;
    std::size_t faults_ = 0;
};

}  // namespace panelgate::modbus
