#include "panelgate/modbus/ascii_transcript.hpp"

#include <utility>

#include "panelgate/modbus/crc16.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::modbus {
namespace {

constexpr std::uint8_t kBegin = ':';
constexpr std::uint8_t kLineFeed = '\n';
constexpr std::size_t kHead = 2;  // station and function: the LRC stands behind them
/// With the LRC in place of the CRC. Panels and requests are longer than the standard here and
/// there (REST, polls), as in RTU.
constexpr std::size_t kLongest = kMaxLongRequestPdu + 2;

}  // namespace

Bytes to_ascii(ByteView adu) { return encode_ascii(adu[0], pdu_of(adu)); }

AsciiTranscript::AsciiTranscript(HexDigits digits, Duration pause)
    : reader_(digits, kLongest), pause_(pause) {}

void AsciiTranscript::feed(TimePoint now, ByteView characters) {
    if (characters.empty()) return;
    paused_ = paused_ || (open() && now - last_ > pause_);
    last_ = now;
    text_.feed(characters);
}

std::optional<AsciiTranscript::Piece> AsciiTranscript::next() {
    Piece piece;
    std::size_t taken = 0;
    for (const std::uint8_t character : text_.view()) {
        const bool over = std::exchange(paused_, false) || (character == kBegin && open());
        if (over) {
            write_rest(piece);
            piece.end = Piece::End::damage;
        } else {
            ++taken;
            take(character, piece);
        }
        if (piece.end != Piece::End::none) break;
    }
    text_.take(taken);
    given_ += piece.bytes.size();
    if (piece.end != Piece::End::none) {
        reader_.give_up();
        noise_ = false;
        given_ = 0;
    } else if (piece.bytes.empty()) {
        return std::nullopt;
    }
    return piece;
}

void AsciiTranscript::take(std::uint8_t character, Piece& piece) {
    const bool last = character == kLineFeed && reader_.at_end();
    switch (reader_.take(character)) {
        case AsciiReader::Step::outside:
            noise_ = true;
            piece.bytes.push_back(character);
            if (character == kLineFeed) piece.end = Piece::End::damage;
            return;
        case AsciiReader::Step::begun:
        case AsciiReader::Step::inside:
            return;
        case AsciiReader::Step::byte:
            return write_byte(piece);
        case AsciiReader::Step::whole:
            write_check(piece, true);
            piece.end = Piece::End::frame;
            return;
        case AsciiReader::Step::broken:
            if (!last) return break_off(character, piece);
            write_check(piece, false);
            piece.end = Piece::End::damage;
            return;
    }
}

/// The last byte may be the LRC: it is given when the next one shows that it is not.
void AsciiTranscript::write_byte(Piece& piece) {
    const Bytes& bytes = reader_.bytes();
    const std::size_t here = bytes.size();
    if (here <= kHead) {
        piece.bytes.push_back(bytes.back());
    } else if (here > kHead + 1) {
        piece.bytes.push_back(bytes[here - 2]);
    }
}

/// It never was an LRC.
void AsciiTranscript::write_rest(Piece& piece) {
    if (!reader_.partial()) return;
    reader_.give_up();
    if (reader_.bytes().size() > kHead) piece.bytes.push_back(reader_.bytes().back());
}

/// In the place of the LRC. A wrong one is wrong in either order.
void AsciiTranscript::write_check(Piece& piece, bool good) {
    const std::uint16_t crc = crc16(ByteView(reader_.bytes()).first(reader_.bytes().size() - 1));
    const auto low = static_cast<std::uint8_t>(crc & 0xFF);
    const auto high = static_cast<std::uint8_t>(crc >> 8);
    piece.bytes.push_back(good ? low : static_cast<std::uint8_t>(low ^ 1u));
    piece.bytes.push_back(high);
}

/// The rest of the line belongs to what is damaged.
void AsciiTranscript::break_off(std::uint8_t character, Piece& piece) {
    if (reader_.bytes().size() > kHead) piece.bytes.push_back(reader_.bytes().back());
    piece.bytes.push_back(character);
    noise_ = true;
    if (character == kLineFeed) piece.end = Piece::End::damage;
}

void AsciiTranscript::cut() {
    reader_.give_up();
    noise_ = false;
    given_ = 0;
    paused_ = false;
}

}  // namespace panelgate::modbus
