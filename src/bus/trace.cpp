#include "panelgate/bus/trace.hpp"

namespace panelgate::bus {

/// Uninitialised: pages are touched only when written, and only written bytes are read.
ByteRing::ByteRing(std::size_t size)
    : size_(size), bytes_(std::make_unique_for_overwrite<std::uint8_t[]>(size)) {}

std::uint64_t ByteRing::add(ByteView bytes) {
    const std::uint64_t place = end_;
    bytes = bytes.first(std::min(bytes.size(), size_));
    while (!bytes.empty()) {
        const auto at = static_cast<std::size_t>(end_ % size_);
        const ByteView piece = bytes.first(std::min(bytes.size(), size_ - at));
        std::ranges::copy(piece, bytes_.get() + at);
        end_ += piece.size();
        bytes = bytes.subspan(piece.size());
    }
    return place;
}

Bytes ByteRing::at(std::uint64_t place, std::size_t length) const {
    Bytes bytes;
    bytes.reserve(length);
    while (bytes.size() < length) {
        const auto at = static_cast<std::size_t>((place + bytes.size()) % size_);
        const std::size_t piece = std::min(length - bytes.size(), size_ - at);
        bytes.insert(bytes.end(), bytes_.get() + at, bytes_.get() + at + piece);
    }
    return bytes;
}

}  // namespace panelgate::bus
