#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "panelgate/base/byte_queue.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/ascii_frame.hpp"

namespace panelgate::modbus {

/// The frame in ASCII that says what this one says in RTU (address, PDU, CRC of any order).
Bytes to_ascii(ByteView adu);

/// What is heard on an ASCII line, written down as RTU would say it, so that one set of judges
/// serves both: a good frame comes with a right CRC, and what had begun like one and was none (LRC,
/// digits, a pause) with none. Bytes come as they are heard, that a frame has begun is known at
/// once; where it ends, the characters say, and neither silence nor lengths have to. Characters of
/// no frame come as they are, up to the end of their line or the next ':'. Work is linear.
class AsciiTranscript {
  public:
    /// Bytes that follow those before. With an `end` they are the last of what has begun.
    struct Piece {
        enum class End : std::uint8_t {
            none,
            frame,   ///< good: LRC, CR LF
            damage,  ///< no frame
        };
        Bytes bytes;
        End end = End::none;
    };

    /// `pause`: the longest between two characters of a frame (V1.02, 2.5.2.1).
    explicit AsciiTranscript(HexDigits digits, Duration pause = 1s);

    /// Characters that have come at `now`; it never goes back.
    void feed(TimePoint now, ByteView characters);
    /// The next piece of what was fed; to be asked until there is none.
    std::optional<Piece> next();

    /// What has begun was judged without its end, or nobody wants it any more: its rest is noise.
    void cut();
    /// A frame has begun and is not whole.
    bool inside() const { return reader_.partial(); }
    /// Something of what has begun was given already.
    bool has_given() const { return given_ > 0; }

  private:
    bool open() const { return reader_.partial() || noise_; }
    void take(std::uint8_t character, Piece& piece);
    void write_byte(Piece& piece);
    void write_rest(Piece& piece);
    void write_check(Piece& piece, bool good);
    void break_off(std::uint8_t character, Piece& piece);

    AsciiReader reader_;
    Duration pause_;
    ByteQueue text_;
    TimePoint last_{};       ///< character
    bool paused_ = false;    ///< for too long, before what is in text_
    bool noise_ = false;     ///< characters of no frame, whose line is not over
    std::size_t given_ = 0;  ///< bytes of what has begun
};

}  // namespace panelgate::modbus
