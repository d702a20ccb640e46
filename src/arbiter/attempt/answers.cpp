#include "panelgate/arbiter/attempt/answers.hpp"

#include <iterator>

namespace panelgate::arbiter {

std::optional<Bytes> Answers::add(Bytes reply, Others others, const Group& group) {
    in_time_.reset();
    first_came_.reset();
    contradicted_ = contradicted_ || others.any;
    for (const Bytes& other : others.whole) note_said(other);
    std::ranges::move(others.whole, std::back_inserter(set_aside_));
    std::optional<Bytes> surplus = drop_candidate();
    // Two equal ones cannot be distinguished.
    if (surplus == reply) {
        if (!may_be_echo()) first_came_ = times_.came;
        if (!may_be_echo() && !is_early()) in_time_ = times_;
        surplus.reset();
    } else if (surplus) {
        contradicted_ = contradicted_ || kept_ == Kept::held;
        if (contradicted_) note_said(*surplus);
        if (is_early() || kept_ == Kept::held) set_aside_.push_back(*std::exchange(surplus, {}));
        if (is_early()) early_ = Early::followed;
    }
    reply_ = std::move(reply);
    if (contradicted_) note_said(*reply_);
    if (contradicted_) choose(group);
    return surplus;
}

void Answers::note_said(const Bytes& reply) {
    if (said_.size() < kMostSaid && std::ranges::find(said_, reply) == said_.end())
        said_.push_back(reply);
}

/// Of the answers that differ, the reply is the one that came for an earlier attempt, too.
void Answers::choose(const Group& group) {
    const auto chosen =
        std::ranges::find_if(set_aside_, [&](const Bytes& one) { return group.was_said(one); });
    if (chosen == set_aside_.end() || group.was_said(*reply_)) return;
    std::swap(*chosen, *reply_);
    if (kept_ == Kept::held) in_time_ = times_;
}

bool Answers::is_undecided(bool is_copy, const Group& group) const {
    const auto said = [&](const Bytes& one) { return group.was_said(one); };
    return contradicted_ && (is_copy || !said(*reply_) || std::ranges::count_if(said_, said) > 1);
}

void Answers::remember_in(Group& group) {
    group.doubted = drop_candidate().value_or(Bytes{});
    group.doubted_at = times_.came;
    if (contradicted_) group.said.insert(group.said.end(), said_.begin(), said_.end());
    group.doubted_as_early = is_early();
    ++group.doubts;
}

}  // namespace panelgate::arbiter
