// What is heard and is no reply: what it was instead.

#include <algorithm>
#include <utility>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/modbus/rtu_framer.hpp"
#include "reply_size.hpp"

namespace panelgate::modbus {

bool ReplyFramer::holds_start(ByteView bytes) const {
    if (ends_ == Ends::told) return bytes.size() > 1 && is_start(bytes[0], bytes[1]);
    for (std::size_t i = 0; i + 1 < bytes.size(); ++i) {
        if (is_start(bytes[i], bytes[i + 1])) return true;
    }
    return false;
}

/// Not a part of our own frame, which may begin like it.
bool ReplyFramer::is_own_reply(ByteView damaged) const {
    if (!is_read(request_[0]) || !expected_) return false;
    const auto count = static_cast<std::uint8_t>(*expected_ - kReadReplyOverhead);
    return damaged.size() >= std::min(*expected_, kReadRequestAdu + 1) && damaged[0] == station_ &&
           damaged[1] == request_[0] && damaged[2] == count && request_[1] != count;
}

void ReplyFramer::classify(ByteView bytes) {
    if (ends_ == Ends::told) {
        if (!bytes.empty()) step_over(told_part(bytes, station_, false));
        return;
    }
    for (Unused& part : classify_heard(bytes, station_, orders_)) step_over(std::move(part));
}

void ReplyFramer::step_over(Unused part) {
    if (part.kind == Unused::Kind::damaged && holds_start(part.bytes)) {
        damaged_ = true;
        damaged_whole_ = damaged_whole_ || part.bytes.size() >= expected_.value_or(0);
        own_header_ = own_header_ || is_own_reply(part.bytes);
    }
    constexpr std::size_t kKept = 64;  // parts; beyond, only their bytes matter
    if (unused_.size() < kKept) {
        unused_.push_back(std::move(part));
    } else if (unused_.back().bytes.size() < kMaxHeard) {
        unused_.back().bytes.insert(unused_.back().bytes.end(), part.bytes.begin(),
                                    part.bytes.end());
    }
}

Unused told_part(ByteView bytes, std::uint8_t own_station, bool good) {
    Unused part;
    part.bytes.assign(bytes.begin(), bytes.end());
    if (!good) return part;
    part.station = bytes[0];
    part.kind = bytes[0] == own_station ? Unused::Kind::own : Unused::Kind::foreign;
    return part;
}

std::vector<Unused> classify_heard(ByteView bytes, std::uint8_t own_station,
                                   const CrcOrders& orders) {
    std::vector<Unused> parts;
    while (!bytes.empty()) {
        const std::size_t length = known_reply_length(bytes);
        const bool whole =
            length >= kMinAdu && length <= bytes.size() && crc_ok(bytes.first(length), orders);
        const bool rest_is_frame = !whole && bytes.size() >= kMinAdu &&
                                   bytes.size() <= kMaxLongRtuAdu && crc_ok(bytes, orders);
        const std::size_t size = whole ? length : bytes.size();
        Unused part;
        part.bytes.assign(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
        if (whole || rest_is_frame) {
            part.station = bytes[0];
            part.kind = bytes[0] == own_station ? Unused::Kind::own : Unused::Kind::foreign;
        }
        parts.push_back(std::move(part));
        bytes = bytes.subspan(size);
    }
    return parts;
}

}  // namespace panelgate::modbus
