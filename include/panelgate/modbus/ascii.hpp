#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::modbus {

/// Modbus ASCII (serial line V1.02, 2.5.2): ':', two hex digits a byte, LRC, CR LF.
inline constexpr std::size_t kMaxAsciiAdu = 513;  ///< characters, with the longest PDU
inline constexpr std::size_t kMinAsciiAdu = 9;    ///< ':', station, function, LRC, CR LF

/// Longitudinal redundancy check (V1.02, 2.5.2.2): two's complement of the sum of the bytes. Over a
/// message with its LRC it is 0.
std::uint8_t lrc(ByteView bytes);

/// A whole frame in upper-case digits, to be written at once. `pdu` has 1 to 253 bytes.
Bytes encode_ascii(std::uint8_t station, ByteView pdu);

/// The standard has upper-case digits only (V1.02, 2.5.2).
enum class HexDigits : std::uint8_t { upper_only, any_case };

/// The end of what is damaged is a line of hex digits with lower-case ones among them, which is
/// what a frame leaves where only upper case is taken.
bool ends_in_lower_case(ByteView damaged);

/// Tells frames by their characters, one by one. A ':' always begins a frame. Pure; knows no time.
class AsciiReader {
  public:
    /// `longest`: bytes of a frame with its LRC.
    explicit AsciiReader(HexDigits digits, std::size_t longest = kMaxPdu + 2)
        : digits_(digits), longest_(longest) {}

    /// What a character is.
    enum class Step : std::uint8_t {
        outside,  ///< of no frame
        begun,    ///< its ':'; a frame that was not whole is given up
        inside,   ///< half a byte, or CR
        byte,     ///< bytes() has one more
        whole,    ///< the frame is good
        broken,   ///< what had begun can be no frame
    };
    Step take(std::uint8_t character);
    /// A frame has begun and is not whole.
    bool partial() const { return state_ != State::between; }
    /// Only its LF is missing.
    bool at_end() const { return state_ == State::at_end; }
    /// Of the frame, so far: station, PDU, LRC. Until the next ':'.
    const Bytes& bytes() const { return bytes_; }
    void give_up() { end(Step::broken); }

  private:
    enum class State : std::uint8_t { between, digits, at_end };
    Step take_digit(std::uint8_t character);
    Step end(Step step);

    HexDigits digits_;
    std::size_t longest_;
    State state_ = State::between;
    Bytes bytes_;
    bool half_ = false;  ///< the last byte misses its second digit
};

/// Finds frames in a stream of characters, requests and replies alike. What does not become a good
/// one is dropped and counted, and nobody is told more: a slave does not answer it. Take with
/// next() until it gives nothing before feeding more; then it holds one unfinished frame at most.
/// Work is linear in the characters.
class AsciiFramer {
  public:
    /// `pause`: the longest between two characters of a frame (V1.02, 2.5.2.1).
    explicit AsciiFramer(HexDigits digits = HexDigits::upper_only, Duration pause = 1s)
        : reader_(digits), pause_(pause) {}

    /// Characters that have come at `now`; it never goes back.
    void feed(TimePoint now, ByteView characters);
    std::optional<SerialAdu> next();

    /// A frame has begun and is not whole.
    bool partial() const { return reader_.partial(); }
    /// Characters since the last good frame that belong to none.
    std::size_t discarded() const { return discarded_; }
    /// Frames that have begun and were no good, since the last call.
    std::size_t take_faults();

  private:
    bool take(std::uint8_t character);
    void drop();

    AsciiReader reader_;
    Duration pause_;
    ByteQueue text_;
    TimePoint last_{};       ///< character
    std::size_t begun_ = 0;  ///< characters of the frame, so far
    std::size_t discarded_ = 0;
    std::size_t faults_ = 0;
};

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
