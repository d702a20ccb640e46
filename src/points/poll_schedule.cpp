#include "panelgate/points/poll_schedule.hpp"

#include <algorithm>
#include <map>

namespace panelgate::points {

PollSchedule::PollSchedule(std::span<const Duration> intervals, TimePoint start,
                           const Settings& settings)
    : start_(start), settings_(settings), entries_(intervals.size()) {
    settings_.max_outstanding = std::max<std::size_t>(settings_.max_outstanding, 1);
    settings_.extra_burst = std::max<std::size_t>(settings_.extra_burst, 1);
    set_phases(intervals);
    for (std::size_t i = 0; i < entries_.size(); ++i) queue_.emplace(entries_[i].due, i);
}

void PollSchedule::set_phases(std::span<const Duration> intervals) {
    std::map<Duration, std::vector<std::size_t>> groups;
    for (std::size_t i = 0; i < intervals.size(); ++i)
        groups[std::max(intervals[i], kShortest)].push_back(i);
    if (groups.empty()) return;
    // The groups share out the shortest step between two entries of one interval: 1 s and 2 s would
    // otherwise meet every 2 s.
    Duration shortest = Duration::max();
    for (const auto& [every, members] : groups)
        shortest = std::min(shortest, every / static_cast<Duration::rep>(members.size()));
    const Duration shift = shortest / static_cast<Duration::rep>(groups.size());
    Duration offset{};
    for (const auto& [every, members] : groups) {
        const auto count = static_cast<Duration::rep>(members.size());
        const Duration step = every / count;
        const Duration first_step = std::min(every, settings_.first_within) / count;
        for (Duration::rep k = 0; k < count; ++k) {
            entries_[members[static_cast<std::size_t>(k)]] = {
                every, k * step + offset, start_ + k * first_step + offset, false, false};
        }
        offset += shift;
    }
}

/// Moves an entry to its first turn after `now`. Gives how many turns that passes over, the one
/// that was due included.
std::uint64_t PollSchedule::advance(std::size_t index, TimePoint now) {
    Entry& entry = entries_[index];
    const TimePoint origin = start_ + entry.phase;
    const auto turn_after = [&](TimePoint time) -> Duration::rep {
        return time < origin ? 0 : (time - origin) / entry.every + 1;
    };
    const auto passed = turn_after(now) - turn_after(entry.due);
    queue_.erase({entry.due, index});
    entry.due = origin + turn_after(now) * entry.every;
    entry.hastened = false;
    queue_.emplace(entry.due, index);
    return static_cast<std::uint64_t>(passed) + 1;
}

std::optional<TimePoint> PollSchedule::next_due() const {
    if (queue_.empty() || outstanding_ >= settings_.max_outstanding) return std::nullopt;
    return queue_.begin()->first;
}

std::vector<std::size_t> PollSchedule::take_due(TimePoint now) {
    std::vector<std::size_t> due;
    while (!queue_.empty() && queue_.begin()->first <= now &&
           outstanding_ < settings_.max_outstanding) {
        const std::size_t index = queue_.begin()->second;
        const std::uint64_t turns = advance(index, now);
        if (entries_[index].under_way) {
            counters_.skipped += turns;
            continue;
        }
        counters_.missed += turns - 1;
        entries_[index].under_way = true;
        ++outstanding_;
        due.push_back(index);
    }
    return due;
}

void PollSchedule::hasten(std::size_t index, TimePoint now) {
    Entry& entry = entries_[index];
    if (entry.under_way || entry.hastened) return;
    const Duration burst =
        settings_.extra_every * static_cast<Duration::rep>(settings_.extra_burst - 1);
    const TimePoint turn = std::max({now, extra_free_ - burst, last_extra_ + 1ns});
    if (entry.due <= turn) return;
    last_extra_ = turn;
    extra_free_ = std::max(extra_free_, now) + settings_.extra_every;
    again_at(index, turn);
    entry.hastened = true;
}

void PollSchedule::again_at(std::size_t index, TimePoint when) {
    Entry& entry = entries_[index];
    if (entry.under_way || entry.due <= when) return;
    queue_.erase({entry.due, index});
    entry.due = when;
    queue_.emplace(entry.due, index);
}

void PollSchedule::on_done(std::size_t index, TimePoint now) {
    if (index >= entries_.size() || !entries_[index].under_way) return;
    entries_[index].under_way = false;
    --outstanding_;
    // A turn that came meanwhile is lost, or this entry would overtake all that wait.
    if (entries_[index].due <= now) counters_.skipped += advance(index, now);
}

}  // namespace panelgate::points
