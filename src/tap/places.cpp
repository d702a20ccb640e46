#include "panelgate/tap/places.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <iterator>
#include <utility>

namespace panelgate::tap {

namespace {

auto is_of(ByteView request) {
    return [request](const auto& place) { return std::ranges::equal(place.request, request); };
}

}  // namespace

bool Places::answered(TimePoint now, const Reply& reply, const std::optional<Reply>& last) {
    const bool repeats = last && !std::ranges::equal(last->request, reply.request) &&
                         std::ranges::equal(last->pdu, reply.pdu);
    const bool known = is_known(now);
    Place& place = at(reply.request);
    const bool suspicious = repeats && !std::ranges::equal(place.said, reply.pdu);
    const bool again = !place.suspect.empty();
    if (again) {
        // Twice so: the two places are equal.
        if (suspicious || std::ranges::equal(place.suspect, reply.pdu))
            score_ = 0;
        else
            judge(now, place, reply.pdu);
    }
    place.suspect.clear();
    if (suspicious && !place.said.empty()) {
        mark(place, find(last->request), reply.pdu);
        if (known || (!again && std::ssize(place.telling) >= kTelling)) return true;
        if (!again) return false;
        place.suspect.clear();
    }
    say(place, reply.pdu);
    return suspicious && known;
}

/// It may be the source's: notes which bytes tell so.
void Places::mark(Place& place, const Place* source, ByteView reply) {
    place.suspect.assign(reply.begin(), reply.end());
    place.telling.clear();
    if (source == nullptr || source->said != place.suspect) return;
    for (std::size_t i = 0; i < std::min(reply.size(), place.said.size()); ++i) {
        const unsigned changed = place.said[i] ^ reply[i];
        const bool is_flag = std::has_single_bit(changed);
        if (changed != 0 && !is_flag && place.steady[i] >= kSteady && source->steady[i] >= kSteady)
            place.telling.push_back(i);
    }
}

/// The place has said something else after the suspect: where that is what it had said before, the
/// suspect was the other's.
void Places::judge(TimePoint now, const Place& place, ByteView reply) {
    const auto found = static_cast<int>(std::ranges::count_if(place.telling, [&](std::size_t i) {
        return i < reply.size() && reply[i] == place.said[i];
    }));
    if (found == 0) return;
    if (now - scored_ >= memory_) score_ = 0;
    score_ += found;
    scored_ = now;
    if (score_ >= kTelling) found_out_ = now;
}

void Places::say(Place& place, ByteView reply) {
    place.steady.resize(reply.size());
    for (std::size_t i = 0; i < reply.size(); ++i) {
        const bool same = i < place.said.size() && place.said[i] == reply[i];
        place.steady[i] =
            static_cast<std::uint8_t>(same ? std::min(place.steady[i] + 1u, kSteady) : 0u);
    }
    place.said.assign(reply.begin(), reply.end());
}

const Places::Place* Places::find(ByteView request) const {
    const auto found = std::ranges::find_if(places_, is_of(request));
    return found == places_.end() ? nullptr : &*found;
}

Places::Place& Places::at(ByteView request) {
    const auto found = std::ranges::find_if(places_, is_of(request));
    if (found != places_.end()) {
        std::rotate(found, found + 1, places_.end());
        return places_.back();
    }
    if (places_.size() == kPlaces) places_.erase(places_.begin());
    Place place;
    place.request.assign(request.begin(), request.end());
    places_.push_back(std::move(place));
    return places_.back();
}

}  // namespace panelgate::tap
