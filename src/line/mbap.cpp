#include "mbap.hpp"

#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::line {

namespace {

constexpr std::size_t kSmallestLength = 2;  ///< of the length field: unit and function
constexpr std::size_t kLargestLength = 254;

std::uint16_t word_at(ByteView bytes, std::size_t at) {
    return static_cast<std::uint16_t>(bytes[at] << 8 | bytes[at + 1]);
}

void add_word(Bytes& bytes, std::size_t word) {
    bytes.push_back(static_cast<std::uint8_t>(word >> 8));
    bytes.push_back(static_cast<std::uint8_t>(word));
}

}  // namespace

void Mbap::restart() {
    partial_.clear();
    waits_ = false;
}

Bytes Mbap::request(ByteView frame) {
    unit_ = frame[0];
    waits_ = unit_ != modbus::kBroadcast;
    Bytes adu;
    add_word(adu, ++id_);
    add_word(adu, 0);
    add_word(adu, frame.size() - modbus::kCrcSize);
    adu.insert(adu.end(), frame.begin(), frame.end() - modbus::kCrcSize);
    return adu;
}

std::optional<Bytes> Mbap::replies(ByteView received) {
    partial_.insert(partial_.end(), received.begin(), received.end());
    Bytes frames;
    std::size_t at = 0;
    while (partial_.size() - at >= kHeader) {
        const ByteView adu = ByteView(partial_).subspan(at);
        const std::size_t length = word_at(adu, 4);
        if (word_at(adu, 2) != 0 || length < kSmallestLength || length > kLargestLength)
            return std::nullopt;
        if (adu.size() < kHeader - 1 + length) break;
        if (waits_ && word_at(adu, 0) == id_) {
            waits_ = false;
            const Bytes frame = modbus::encode_adu(unit_, adu.subspan(kHeader, length - 1));
            frames.insert(frames.end(), frame.begin(), frame.end());
        }
        at += kHeader - 1 + length;
    }
    partial_.erase(partial_.begin(), partial_.begin() + static_cast<std::ptrdiff_t>(at));
    return frames;
}

}  // namespace panelgate::line
