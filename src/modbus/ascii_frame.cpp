#include "panelgate/modbus/ascii_frame.hpp"

#include <string_view>
#include <utility>

#include "panelgate/modbus/function.hpp"

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
        half_ = false;
        return Step::begun;
    }
    if (state_ == State::between) return Step::outside;
    if (state_ == State::digits) return take_digit(character);
    const bool good = character == kLineFeed && lrc(bytes_) == 0;
    return end(good ? Step::whole : Step::broken);
}

AsciiReader::Step AsciiReader::take_digit(std::uint8_t character) {
    if (character == kCarriageReturn) {
        if (half_ || bytes_.size() < kMinBytes) return end(Step::broken);
        state_ = State::at_end;
        return Step::inside;
    }
    const auto value = value_of(character, digits_);
    const bool full = bytes_.size() == longest_ && !half_;
    if (!value || full) return end(Step::broken);
    if (std::exchange(half_, !half_)) {
        bytes_.back() = static_cast<std::uint8_t>(unsigned{bytes_.back()} << 4 | *value);
        return Step::byte;
    }
    bytes_.push_back(static_cast<std::uint8_t>(*value));
    return Step::inside;
}

AsciiReader::Step AsciiReader::end(Step step) {
    state_ = State::between;
    if (std::exchange(half_, false)) bytes_.pop_back();
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

/// Does it make a frame whole?
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

}  // namespace panelgate::modbus
