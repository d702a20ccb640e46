#include "panelgate/tap/habits.hpp"

#include <algorithm>
#include <functional>

namespace panelgate::tap {

void GiveUp::seen(Duration interval) {
    seen_.push_back(interval);
    if (seen_.size() > kKept) seen_.pop_front();
    outwaited_.clear();
}

void GiveUp::outwaited(Duration interval) {
    outwaited_.push_back(interval);
    if (outwaited_.size() < kNeeded) return;
    const Duration waited = *std::ranges::min_element(outwaited_);
    std::erase_if(seen_, [&](Duration given_up) { return given_up <= waited; });
    outwaited_.clear();
    refuted_ = true;
}

std::optional<Duration> GiveUp::least() const {
    if (seen_.size() < kNeeded) return std::nullopt;
    return *std::ranges::min_element(seen_);
}

void BroadcastHabit::answered(TimePoint now) {
    constexpr Duration kLatest = 1200ms;  // the latest answer that was seen came after a second
    none_ = none_ || (since_ && now - *since_ >= kLatest);
}

void Habits::answered(Duration think, bool differs) {
    constexpr int kMemory = 64;  // replies, until one slow reply is nearly forgotten
    longest_ = longest_ ? std::max(think, *longest_ - (*longest_ - think) / kMemory) : think;
    if (differs) {
        differing_.push_back(think);
        if (differing_.size() > kThinks) differing_.pop_front();
    }
    thinks_.push_back(think);
    if (thinks_.size() > kThinks) thinks_.pop_front();
}

std::optional<Duration> Habits::usual_think() const {
    if (thinks_.empty()) return std::nullopt;
    std::deque<Duration> sorted = thinks_;
    std::ranges::sort(sorted, std::greater<>());
    return sorted[sorted.size() / kSlower];
}

bool Habits::is_too_soon(Duration think) const {
    return differing_.size() >= kSome && think < *std::ranges::min_element(differing_) * 3 / 4;
}

bool Habits::seems_too_soon(Duration think) {
    if (hasty_ == kHasty || differing_.size() < kThinks || !is_too_soon(think)) return false;
    ++hasty_;
    return true;
}

void Habits::asks(const Bytes& pdu) {
    std::erase(reads_, pdu);
    reads_.push_back(pdu);
    if (reads_.size() > kReads) reads_.pop_front();
}

bool Habits::has_asked(ByteView pdu) const {
    return std::ranges::any_of(reads_,
                               [&](const Bytes& read) { return std::ranges::equal(read, pdu); });
}

}  // namespace panelgate::tap
