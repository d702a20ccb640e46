#include "wire.hpp"

#include <algorithm>

namespace zoo {
namespace {

Time at_or_zero(const std::vector<Time>& times, std::size_t i) {
    return i < times.size() ? times[i] : 0;
}

}  // namespace

// Nobody says two things at once: the earliest moment from `start` on with so much time.
Time Wire::free_from(Time start, Time duration, int speaker) const {
    for (const Character& c : coming_) {
        if (c.speaker == speaker && c.start < start + duration && start < c.end) start = c.end;
    }
    return start;
}

Time Wire::say(const Speech& speech) {
    const auto length = static_cast<Time>(static_cast<double>(character_) / speech.rate);
    Time duration = length * static_cast<Time>(speech.bytes.size());
    for (const Time pause : speech.pauses) duration += pause;
    Time at = free_from(speech.start, duration, speech.speaker);
    for (std::size_t i = 0; i < speech.bytes.size(); ++i) {
        at += at_or_zero(speech.pauses, i);
        const Character one{.start = at,
                            .end = at + length,
                            .hold = at_or_zero(speech.holds, i),
                            .speaker = speech.speaker,
                            .value = speech.bytes[i],
                            .first = i == 0,
                            .last = i + 1 == speech.bytes.size()};
        const auto place =
            std::upper_bound(coming_.begin(), coming_.end(), one.end,
                             [](Time end, const Character& other) { return end < other.end; });
        coming_.insert(place, one);
        at = one.end;
    }
    return at;
}

bool Wire::meets_another(const Character& one) const {
    const auto meets = [&one](const Character& other) {
        return other.speaker != one.speaker && other.start < one.end && one.start < other.end;
    };
    return std::any_of(gone_.begin(), gone_.end(), meets) ||
           std::any_of(coming_.begin(), coming_.end(), meets);
}

std::optional<Character> Wire::passed(Time now) {
    if (coming_.empty() || coming_.front().end > now) return std::nullopt;
    Character one = coming_.front();
    coming_.erase(coming_.begin());
    one.damaged = meets_another(one);
    std::erase_if(gone_,
                  [&one, this](const Character& c) { return c.end + 4 * character_ < one.start; });
    gone_.push_back(one);
    busy_until_ = std::max(busy_until_, one.end);
    if (one.damaged) {
        ++collisions_;
        one.value = static_cast<std::uint8_t>(one.value ^ (dice_.next() % 255 + 1));
    }
    return one;
}

std::optional<Time> Wire::next(Time grain_end) const {
    if (coming_.empty()) return std::nullopt;
    Time at = std::max(coming_.front().end, grain_end);
    for (const Character& c : coming_) {
        if (c.end >= at) break;
        if (c.last) return c.end;
    }
    return at;
}

}  // namespace zoo
