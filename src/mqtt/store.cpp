#include "panelgate/mqtt/store.hpp"

#include <algorithm>
#include <utility>

namespace panelgate::mqtt {

void Store::add(std::size_t subject, State state) {
    if (changes_.size() >= limit_ && sent_ < changes_.size()) {
        erase(sent_);
        ++dropped_;
    }
    changes_.push_back({next_number_++, subject, std::move(state)});
}

const Change* Store::next() const { return sent_ < changes_.size() ? &changes_[sent_] : nullptr; }

void Store::sent() { ++sent_; }

void Store::skip() { erase(sent_); }

void Store::delivered(std::uint64_t number) {
    const auto found = std::ranges::lower_bound(changes_, number, {}, &Change::number);
    const auto place = static_cast<std::size_t>(found - changes_.begin());
    if (place >= sent_ || found->number != number) return;
    erase(place);
    --sent_;
}

void Store::erase(std::size_t place) {
    changes_.erase(changes_.begin() + static_cast<std::ptrdiff_t>(place));
}

}  // namespace panelgate::mqtt
