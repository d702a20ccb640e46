#include "panelgate/modbus/ascii_frame.hpp"

#include <string_view>
#include <utility>

#include "panelgate/modbus/function.hpp"

namespace panelgate::modbus {
namespace {

constexpr std::uint8_t kBegin = ':';
constexpr std::uint8_t kCarriageReturn = '\r';
constexpr std::uint8_t kLineFeed = '\n';
constexpr std::size_t kMinBytes = 3;            // station, function, LRC
constexpr std::size_t kMaxBytes = kMaxPdu + 2;  // station and LRC around it

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
    SerialAdu adu;
    adu.station = bytes_.front();
    adu.pdu.assign(bytes_.begin() + 1, bytes_.end() - 1);
    state_ = State::between;
    discarded_ = 0;
    return adu;
}

/// Is `bytes_` a good frame now?
bool AsciiFramer::take(std::uint8_t character) {
    if (character == kBegin) {
        if (partial()) drop();
        begin();
        return false;
    }
    if (state_ == State::between) {
        ++discarded_;
        return false;
    }
    ++begun_;
    if (state_ == State::digits) {
        take_digit(character);
        return false;
    }
    const bool good = character == kLineFeed && lrc(bytes_) == 0;
    if (!good) drop();
    return good;
}

void AsciiFramer::take_digit(std::uint8_t character) {
    if (character == kCarriageReturn) {
        if (half_ || bytes_.size() < kMinBytes) return drop();
        state_ = State::at_end;
        return;
    }
    const auto value = value_of(character, digits_);
    const bool full = bytes_.size() == kMaxBytes && !half_;
    if (!value || full) return drop();
    if (std::exchange(half_, !half_)) {
        bytes_.back() = static_cast<std::uint8_t>(unsigned{bytes_.back()} << 4 | *value);
    } else {
        bytes_.push_back(static_cast<std::uint8_t>(*value));
    }
}

void AsciiFramer::begin() {
    state_ = State::digits;
    bytes_.clear();
    half_ = false;
    begun_ = 1;
}

void AsciiFramer::drop() {
    state_ = State::between;
    discarded_ += begun_;
    ++faults_;
}

std::size_t AsciiFramer::take_faults() { return std::exchange(faults_, 0); }

}  // namespace panelgate::modbus
