#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::modbus {

/// Modbus ASCII (serial line V1.02, 2.5.2): ':', two hex digits per byte, LRC, CR LF.
inline constexpr std::size_t kMaxAsciiAdu = 513;  ///< characters, with the longest PDU
inline constexpr std::size_t kMinAsciiAdu = 9;    ///< ':', station, function, LRC, CR LF

/// Longitudinal redundancy check (V1.02, 2.5.2.2): two's complement of the sum of the bytes. Over a
/// message with its LRC it is 0.
std::uint8_t lrc(ByteView bytes);

/// Encodes a whole frame in upper-case digits, to be sent in one write. `pdu` has 1 to 253 bytes.
Bytes encode_ascii(std::uint8_t station, ByteView pdu);

/// The standard allows upper-case digits only (V1.02, 2.5.2).
enum class HexDigits : std::uint8_t { upper_only, any_case };

/// True if the damaged bytes end with a line of hex digits that has lower-case ones: a frame that
/// was rejected because only upper case is taken.
bool ends_in_lower_case(ByteView damaged);

/// True if the damaged bytes, as transcribed, are a frame of ASCII that is right but for its
/// delimiters: it begins with another character than ':', or does not end with CR LF alone.
/// `expected`: bytes of the reply that was awaited, with its CRC; 0: unknown.
bool has_other_delimiters(ByteView damaged, std::size_t expected);

/// Parses frames character by character. A ':' always begins a frame. Pure; ignores time.
class AsciiReader {
  public:
    /// `longest`: maximum bytes of a frame with its LRC.
    explicit AsciiReader(HexDigits digits, std::size_t longest = kMaxPdu + 2)
        : digits_(digits), longest_(longest) {}

    /// Meaning of a character.
    enum class Step : std::uint8_t {
        outside,  ///< not part of a frame
        begun,    ///< ':'; an unfinished frame is dropped
        inside,   ///< half a byte, or CR
        byte,     ///< bytes() has one more
        whole,    ///< the frame is complete and valid
        broken,   ///< the frame that had begun is invalid
    };
    Step take(std::uint8_t character);
    /// True if a frame has begun and is not complete.
    bool partial() const { return state_ != State::between; }
    /// True if only the LF is missing.
    bool at_end() const { return state_ == State::at_end; }
    /// Returns the bytes of the frame so far: station, PDU, LRC. Valid until the next ':'.
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
    bool has_half_byte_ = false;  ///< the last byte lacks its second digit
};

/// Finds frames in a stream of characters, requests and replies alike. Invalid frames are dropped
/// and counted without a reply, as a slave does. Call next() until it returns std::nullopt before
/// feeding more; then at most one unfinished frame is buffered. Linear time.
class AsciiFramer {
  public:
    /// `pause`: maximum time between two characters of a frame (V1.02, 2.5.2.1).
    explicit AsciiFramer(HexDigits digits = HexDigits::upper_only, Duration pause = 1s)
        : reader_(digits), pause_(pause) {}

    /// Feeds characters received at `now`, which must not decrease.
    void feed(TimePoint now, ByteView characters);
    std::optional<SerialAdu> next();

    /// True if a frame has begun and is not complete.
    bool partial() const { return reader_.partial(); }
    /// Returns the characters since the last valid frame that belong to none.
    std::size_t discarded() const { return discarded_; }
    /// Returns the number of invalid frames since the last call.
    std::size_t take_faults();

  private:
    bool take(std::uint8_t character);
    void drop();

    AsciiReader reader_;
    Duration pause_;
    ByteQueue text_;
    TimePoint last_{};       ///< of the last character
    std::size_t begun_ = 0;  ///< characters of the frame, so far
    std::size_t discarded_ = 0;
    std::size_t faults_ = 0;
};

/// Converts an RTU frame (address, PDU, CRC of any order) to ASCII.
Bytes to_ascii(ByteView adu);

/// Transcribes an ASCII line to RTU, so that the RTU framers serve both: a valid frame gets a
/// correct CRC, an invalid one (LRC, digits, a pause) does not. Bytes are passed on as they arrive,
/// so the start of a frame is known at once; characters mark its end, so neither silence nor
/// lengths are needed. Characters outside frames are passed on unchanged, up to the end of their
/// line or the next ':'. Linear time.
class AsciiTranscript {
  public:
    /// The next bytes. With an `end` they are the last of the current frame.
    struct Piece {
        enum class End : std::uint8_t {
            none,
            frame,   ///< valid: LRC, CR LF
            damage,  ///< not a valid frame
            cut,     ///< ... another begins, or too long a pause followed: it may begin anew
        };
        Bytes bytes;
        End end = End::none;
    };

    /// `pause`: maximum time between two characters of a frame (V1.02, 2.5.2.1).
    explicit AsciiTranscript(HexDigits digits, Duration pause = 1s);

    /// Feeds characters received at `now`, which must not decrease.
    void feed(TimePoint now, ByteView characters);
    /// Returns the next piece; call it until it returns std::nullopt.
    std::optional<Piece> next();

    /// Abandons the current frame, judged early or not needed any more: its rest is noise.
    void cut();
    /// True if a frame has begun and is not complete.
    bool inside() const { return reader_.partial(); }
    /// True if, behind what was returned, a frame has begun or was fed.
    bool goes_on() const;
    /// True if a part of the current frame was already returned.
    bool has_given() const { return given_ > 0; }

  private:
    bool open() const { return reader_.partial() || noise_; }
    void take(std::uint8_t character, Piece& piece);
    void write_byte(Piece& piece);
    void write_rest(Piece& piece);
    void write_check(Piece& piece, bool good);
    void abort_frame(std::uint8_t character, Piece& piece);

    AsciiReader reader_;
    Duration pause_;
    ByteQueue text_;
    TimePoint last_{};       ///< of the last character
    bool paused_ = false;    ///< too long a pause before text_
    bool noise_ = false;     ///< inside a line of noise
    std::size_t given_ = 0;  ///< bytes of the current frame already returned
};

}  // namespace panelgate::modbus
