#include "panelgate/modbus/ascii.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::modbus {

namespace {

constexpr std::uint8_t kBegin = ':';
constexpr std::uint8_t kCarriageReturn = '\r';
constexpr std::uint8_t kLineFeed = '\n';
constexpr std::size_t kMinBytes = 3;  // station, function, LRC

std::optional<unsigned> value_of(std::uint8_t digit, HexDigits digits) {
    if (digit >= '0' && digit <= '9') return digit - unsigned{'0'};
    if (digit >= 'A' && digit <= 'F') return digit - unsigned{'A'} + 10;
    if (digits == HexDigits::any_case && digit >= 'a' && digit <= 'f')
        return digit - unsigned{'a'} + 10;
    return std::nullopt;
}

void put_hex(Writer& out, std::uint8_t byte) {
    constexpr std::string_view kDigits = "0123456789ABCDEF";
    out.u8(static_cast<unsigned char>(kDigits[byte >> 4]));
    out.u8(static_cast<unsigned char>(kDigits[byte & 0x0F]));
}

}  // namespace

std::uint8_t lrc(ByteView bytes) {
    unsigned sum = 0;
    for (const std::uint8_t byte : bytes) sum += byte;
    return static_cast<std::uint8_t>(0u - sum);
}

Bytes encode_ascii(std::uint8_t station, ByteView pdu) {
    Writer out(2 * pdu.size() + kMinAsciiAdu - 2);
    out.u8(kBegin);
    put_hex(out, station);
    for (const std::uint8_t byte : pdu) put_hex(out, byte);
    put_hex(out, static_cast<std::uint8_t>(lrc(pdu) - station));
    out.u8(kCarriageReturn).u8(kLineFeed);
    return out.take();
}

bool ends_in_lower_case(ByteView damaged) {
    const std::size_t size = damaged.size();
    if (size < 3 || damaged[size - 2] != kCarriageReturn || damaged[size - 1] != kLineFeed)
        return false;
    bool lower = false;
    for (std::size_t i = size - 2; i > 0 && value_of(damaged[i - 1], HexDigits::any_case); --i)
        lower = lower || damaged[i - 1] >= 'a';
    return lower;
}

AsciiReader::Step AsciiReader::take(std::uint8_t character) {
    if (character == kBegin) {
        state_ = State::digits;
        bytes_.clear();
        has_half_byte_ = false;
        return Step::begun;
    }
    if (state_ == State::between) return Step::outside;
    if (state_ == State::digits) return take_digit(character);
    const bool good = character == kLineFeed && lrc(bytes_) == 0;
    return end(good ? Step::whole : Step::broken);
}

AsciiReader::Step AsciiReader::take_digit(std::uint8_t character) {
    if (character == kCarriageReturn) {
        if (has_half_byte_ || bytes_.size() < kMinBytes) return end(Step::broken);
        state_ = State::at_end;
        return Step::inside;
    }
    const auto value = value_of(character, digits_);
    const bool full = bytes_.size() == longest_ && !has_half_byte_;
    if (!value || full) return end(Step::broken);
    if (std::exchange(has_half_byte_, !has_half_byte_)) {
        bytes_.back() = static_cast<std::uint8_t>(unsigned{bytes_.back()} << 4 | *value);
        return Step::byte;
    }
    bytes_.push_back(static_cast<std::uint8_t>(*value));
    return Step::inside;
}

AsciiReader::Step AsciiReader::end(Step step) {
    state_ = State::between;
    if (std::exchange(has_half_byte_, false)) bytes_.pop_back();
    return step;
}

void AsciiFramer::feed(TimePoint now, ByteView characters) {
    if (characters.empty()) return;
    if (partial() && now - last_ > pause_) drop();
    last_ = now;
    text_.feed(characters);
}

std::optional<SerialAdu> AsciiFramer::next() {
    std::size_t taken = 0;
    bool whole = false;
    for (const std::uint8_t character : text_.view()) {
        ++taken;
        whole = take(character);
        if (whole) break;
    }
    text_.take(taken);
    if (!whole) return std::nullopt;
    const Bytes& bytes = reader_.bytes();
    SerialAdu adu;
    adu.station = bytes.front();
    adu.pdu.assign(bytes.begin() + 1, bytes.end() - 1);
    discarded_ = 0;
    return adu;
}

/// True if the character completes a frame.
bool AsciiFramer::take(std::uint8_t character) {
    if (character == kBegin && partial()) drop();
    switch (reader_.take(character)) {
        case AsciiReader::Step::outside:
            ++discarded_;
            return false;
        case AsciiReader::Step::begun:
            begun_ = 1;
            return false;
        case AsciiReader::Step::inside:
        case AsciiReader::Step::byte:
            ++begun_;
            return false;
        case AsciiReader::Step::whole:
            return true;
        case AsciiReader::Step::broken:
            ++begun_;
            drop();
            return false;
    }
    return false;
}

void AsciiFramer::drop() {
    reader_.give_up();
    discarded_ += begun_;
    ++faults_;
}

std::size_t AsciiFramer::take_faults() { return std::exchange(faults_, 0); }

namespace {

constexpr std::size_t kHead = 2;  // station and function; the LRC comes later
/// With the LRC in place of the CRC. Frames of some panels and requests (REST, polls) exceed the
/// standard's length, as in RTU.
constexpr std::size_t kLongest = kMaxLongRequestPdu + 2;

}  // namespace

namespace {

/// A line of text that is a frame, but for its first character.
bool begins_otherwise(ByteView text) {
    if (text.size() < kMinAsciiAdu) return false;
    AsciiReader reader(HexDigits::any_case, kLongest);
    AsciiReader::Step step = reader.take(kBegin);
    for (const std::uint8_t character : text.subspan(1)) step = reader.take(character);
    return step == AsciiReader::Step::whole;
}

}  // namespace

/// Ends of the field: LF alone, CR CR LF, a blank before CR LF. Of a frame that ends with CR alone
/// the LRC is not given, because no end has come.
bool has_other_delimiters(ByteView damaged, std::size_t expected) {
    if (damaged.size() + 2 == expected) return true;
    constexpr std::size_t kLongestEnd = 3;
    constexpr std::string_view kEnds = "\r\n ";
    for (std::size_t end = 1; end <= kLongestEnd && damaged.size() >= kMinBytes + end; ++end) {
        const std::uint8_t last = damaged[damaged.size() - end];
        if (kEnds.find(static_cast<char>(last)) == kEnds.npos) break;
        if (lrc(damaged.first(damaged.size() - end)) == 0) return true;
    }
    return begins_otherwise(damaged);
}

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
            piece.end = Piece::End::cut;
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
            if (!last) return abort_frame(character, piece);
            write_check(piece, false);
            piece.end = Piece::End::damage;
            return;
    }
}

/// Writes the bytes with a delay of one: the last one may be the LRC.
void AsciiTranscript::write_byte(Piece& piece) {
    const Bytes& bytes = reader_.bytes();
    const std::size_t here = bytes.size();
    if (here <= kHead) {
        piece.bytes.push_back(bytes.back());
    } else if (here > kHead + 1) {
        piece.bytes.push_back(bytes[here - 2]);
    }
}

/// Writes the delayed byte, which was no LRC.
void AsciiTranscript::write_rest(Piece& piece) {
    if (!reader_.partial()) return;
    reader_.give_up();
    if (reader_.bytes().size() > kHead) piece.bytes.push_back(reader_.bytes().back());
}

/// Writes a CRC in place of the LRC; a wrong one is wrong in either order.
void AsciiTranscript::write_check(Piece& piece, bool good) {
    const std::uint16_t crc = crc16(ByteView(reader_.bytes()).first(reader_.bytes().size() - 1));
    const auto low = static_cast<std::uint8_t>(crc & 0xFF);
    const auto high = static_cast<std::uint8_t>(crc >> 8);
    piece.bytes.push_back(good ? low : static_cast<std::uint8_t>(low ^ 1u));
    piece.bytes.push_back(high);
}

/// Breaks off a damaged frame; the rest of its line belongs to it.
void AsciiTranscript::abort_frame(std::uint8_t character, Piece& piece) {
    if (reader_.bytes().size() > kHead) piece.bytes.push_back(reader_.bytes().back());
    piece.bytes.push_back(character);
    noise_ = true;
    if (character == kLineFeed) piece.end = Piece::End::damage;
}

bool AsciiTranscript::goes_on() const {
    return inside() || std::ranges::find(text_.view(), kBegin) != text_.view().end();
}

void AsciiTranscript::cut() {
    reader_.give_up();
    noise_ = false;
    given_ = 0;
    paused_ = false;
}

}  // namespace panelgate::modbus
