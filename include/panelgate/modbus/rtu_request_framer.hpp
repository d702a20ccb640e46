#pragma once

#include <cstddef>
#include <optional>

#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/modbus/rtu_framer.hpp"

namespace panelgate::modbus {

/// How long an RTU request is (address to CRC), as far as its own first bytes tell; the same three
/// cases as of a reply. 08/0000 may carry any number of words and ends by silence, as do functions
/// that the standard does not define.
using RequestLength = ReplyLength;
RequestLength request_length(ByteView frame);
/// ... but of 08/0000 with one word of data, as nearly all are, the length is known once its CRC
/// fits.
RequestLength usual_request_length(ByteView frame);
/// What a good RTU frame says.
SerialAdu serial_adu_of(ByteView frame);

/// Finds requests in what a client says, as a slave does, but without the silence around frames
/// that a stream does not keep: the function and the header give the length, the CRC judges. What
/// begins no good frame is stepped over byte by byte. A start that still waits for bytes holds up
/// the later ones, or bytes inside a request could pass for one; a silence gives it up where a good
/// frame stands behind it, and ends requests without a length rule. What is found in bytes that
/// were stepped over may be the data of a damaged write: only pure reads are taken there, anything
/// else is a fault, and those without a length rule are not looked for. A frame counts for itself
/// again behind a silence, and behind more good frames in a row than one damaged frame could hold;
/// up to three stray bytes are a glitch, too short to be the head of a request with data. Take with
/// next() until it gives nothing before feeding more; then it holds 256 bytes at most.
class RtuRequestFramer {
  public:
    void feed(ByteView bytes) { heard_.feed(bytes); }
    std::optional<SerialAdu> next();
    /// Nothing has come for a while: next() may give more now.
    void on_silence();
    /// Gives up what is pending: its rest will not come.
    void drop_pending();

    /// Bytes wait for more, or for a silence.
    bool partial() const { return !heard_.empty(); }
    /// Bytes since the last good frame that belong to none.
    std::size_t discarded() const { return discarded_; }
    /// How often something was stepped over behind a good frame or a silence, and requests that
    /// were not taken there, since the last call.
    std::size_t take_faults();

  private:
    struct Judgement {
        enum class Kind : std::uint8_t { frame, open, nothing };
        Kind kind = Kind::nothing;
        std::size_t size = 0;  ///< of a frame
    };
    Judgement judge(ByteView start) const;
    std::size_t size_by_silence() const;
    /// What begins at the front is no part of something damaged.
    bool sure() const { return trusted_ || since_lost_ <= glitch_limit_; }
    void lose_trust();
    void trust();
    SerialAdu take(std::size_t size);
    void refuse(std::size_t size);
    void step_over(std::size_t count);
    void consume(std::size_t count);
    void go_on_in_row(std::size_t size);

    ByteQueue heard_;
    std::size_t ended_by_silence_ = 0;  ///< size of the frame at the front; 0: none
    bool aligned_ = true;               ///< a good frame or a silence was right before the front
    bool trusted_ = true;               ///< ... and no damaged one can be around them
    std::size_t since_lost_ = 0;        ///< bytes, since that is not so
    std::size_t glitch_limit_ = 0;      ///< as many of them hide nothing
    std::size_t in_row_ = 0;            ///< bytes of good frames, nothing between them
    std::size_t silence_behind_ = 0;    ///< as many bytes there was one; 0: nowhere
    std::size_t discarded_ = 0;
    std::size_t faults_ = 0;
};

}  // namespace panelgate::modbus
