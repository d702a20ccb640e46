#include "ear.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace zoo {
namespace {

constexpr std::size_t kUsbPacket = 62;  // of an FTDI chip: 64 with its status

}  // namespace

void Ear::hear(Time at, std::uint8_t value, Time hold) {
    last_ = std::max(last_, at) + hold;
    if (waiting_.size() < 65536) waiting_.push_back({last_, value});
}

Time Ear::release_of(std::size_t i) const {
    if (latency_ == 0) return waiting_[i].at;
    const std::size_t first = i - i % kUsbPacket;
    const std::size_t full = first + kUsbPacket - 1;
    const Time timer = waiting_[first].at + latency_;
    return full < waiting_.size() ? std::min(timer, waiting_[full].at) : timer;
}

Bytes Ear::due(Time now) {
    Bytes bytes;
    if (now < stopped_until_) return bytes;
    std::size_t count = 0;
    while (count < waiting_.size() && release_of(count) <= now && waiting_[count].at <= now) {
        bytes.push_back(waiting_[count++].value);
    }
    waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(count));
    return bytes;
}

std::optional<Time> Ear::next() const {
    if (waiting_.empty()) return std::nullopt;
    return std::max({stopped_until_, release_of(0), waiting_.front().at});
}

std::optional<Bytes> RequestFinder::hear(const Character& c) {
    if (is_at_start(c)) data_.clear();
    last_ = c.end;
    data_.push_back(c.value);
    const std::size_t length = request_length(data_);
    if (length == 0 || data_.size() != length) return std::nullopt;
    const bool is_good = has_good_crc(data_) || has_good_crc(data_, true);
    if (!is_good) return data_;  // and what follows without a pause belongs to it
    return std::exchange(data_, {});
}

}  // namespace zoo
