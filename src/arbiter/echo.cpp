#include "panelgate/arbiter/echo.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace panelgate::arbiter {

bool teaches_echo(const modbus::Request& request) {
    const auto reply = request.reply_length();
    return reply && (*reply != request.pdu().size() + modbus::kAduOverhead ||
                     modbus::distinct_byte_count(request.pdu()).has_value());
}

bool begins_with_request(ByteView heard, ByteView own, const modbus::CrcOrders& orders) {
    const std::size_t size = modbus::request_adu_length(heard);
    return size != 0 && size <= heard.size() && modbus::crc_ok(heard.first(size), orders) &&
           !std::ranges::equal(heard.first(size), own);
}

bool holds_beginning(ByteView heard, ByteView frame) {
    constexpr std::size_t kHead = 2;  // address and function
    return frame.size() >= kHead && !std::ranges::search(heard, frame.first(kHead)).empty();
}

ByteView EchoFilter::feed(ByteView bytes) {
    if (expect_ == Expect::nothing) return bytes;
    std::size_t taken = 0;
    // A receiver that is switched on late loses the first byte (T6).
    if (matched_ == 0 && !bytes.empty() && frame_.size() > 1 && bytes[0] != frame_[0] &&
        bytes[0] == frame_[1])
        matched_ = 1, lost_ = 1;
    while (taken < bytes.size() && matched_ < frame_.size() && bytes[taken] == frame_[matched_]) {
        ++matched_;
        ++taken;
    }
    const bool certain = expect_ == Expect::certainly;
    if (matched_ == frame_.size()) {
        complete_ = true;
    } else if (taken == bytes.size()) {
        return {};
    } else {
        mismatch_ = certain;
        released_.assign(frame_.begin() + lost_,
                         frame_.begin() + static_cast<std::ptrdiff_t>(matched_));
        released_.insert(released_.end(), bytes.begin() + static_cast<std::ptrdiff_t>(taken),
                         bytes.end());
    }
    expect_ = Expect::nothing;
    matched_ = 0;
    return complete_ ? bytes.subspan(taken) : ByteView(released_);
}

std::size_t EchoFilter::missing() const {
    constexpr std::size_t kOpen = 3;  // a reply begins like the request, up to its byte count
    if (expect_ == Expect::nothing || matched_ == 0) return 0;
    const bool open = expect_ == Expect::perhaps && matched_ < kOpen;
    return (open ? kOpen : frame_.size()) - matched_;
}

Bytes EchoFilter::release() {
    if (!pending()) return {};
    expect_ = Expect::nothing;
    return {frame_.begin() + lost_,
            frame_.begin() + static_cast<std::ptrdiff_t>(std::exchange(matched_, 0))};
}

void EchoMemory::forget() {
    missed_ = 0;
    state_ = mode_ == EchoMode::on    ? EchoState::present
             : mode_ == EchoMode::off ? EchoState::absent
                                      : EchoState::unknown;
}

EchoFilter::Expect EchoMemory::expect() const {
    switch (state_) {
        case EchoState::present:
            return EchoFilter::Expect::certainly;
        case EchoState::absent:
            return EchoFilter::Expect::nothing;
        case EchoState::unknown:
            return EchoFilter::Expect::perhaps;
    }
    std::abort();
}

bool EchoMemory::on_echo() {
    missed_ = 0;
    return std::exchange(state_, EchoState::present) != EchoState::present;
}

void EchoMemory::on_no_echo() {
    if (mode_ == EchoMode::on || state_ == EchoState::absent) return;
    if (state_ == EchoState::unknown || ++missed_ >= kNoMore) state_ = EchoState::absent;
}

}  // namespace panelgate::arbiter
