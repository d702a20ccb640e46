#include "panelgate/arbiter/heard_before.hpp"

#include <algorithm>
#include <functional>
#include <string_view>

namespace panelgate::arbiter {

namespace {

/// Never 0.
std::size_t hash_of(ByteView bytes) {
    const auto* const text = reinterpret_cast<const char*>(bytes.data());
    return std::hash<std::string_view>{}(std::string_view(text, bytes.size())) | 1U;
}

}  // namespace

bool HeardBefore::on_answered(std::uint8_t station, ByteView request, ByteView reply) {
    One& one = stations_[station];
    one.replies[one.next_reply] = hash_of(reply);
    one.next_reply = (one.next_reply + 1) % kReplies;
    const auto found = std::ranges::find(one.unanswered, hash_of(request));
    if (found == one.unanswered.end()) return false;
    *found = 0;
    return true;
}

void HeardBefore::on_unanswered(std::uint8_t station, ByteView request) {
    One& one = stations_[station];
    const std::size_t hash = hash_of(request);
    if (std::ranges::find(one.unanswered, hash) != one.unanswered.end()) return;
    one.unanswered[one.next_read] = hash;
    one.next_read = (one.next_read + 1) % kReads;
}

bool HeardBefore::is_old_reply(std::uint8_t station, ByteView pdu) const {
    const auto found = stations_.find(station);
    if (found == stations_.end()) return false;
    const One& one = found->second;
    const std::size_t hash = hash_of(pdu);
    const std::size_t last = one.replies[(one.next_reply + kReplies - 1) % kReplies];
    return hash != last && std::ranges::find(one.replies, hash) != one.replies.end();
}

}  // namespace panelgate::arbiter
