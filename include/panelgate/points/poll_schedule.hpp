#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "panelgate/base/time.hpp"

namespace panelgate::points {

/// Turns that an entry did not get. Each turn counts once.
struct ScheduleCounters {
    std::uint64_t skipped = 0;  ///< it was still under way
    std::uint64_t missed = 0;   ///< it came so late that its next turn had come as well
};

/// When each entry of a plan is due. Entry i has turns at phase + n * interval after the start,
/// whatever happens in between: nothing drifts, and after a stall an entry is due once, not once
/// for each turn lost. Entries of the same interval are spread evenly over it, and intervals that
/// divide each other do not meet. Pure; early and repeated calls are harmless.
class PollSchedule {
  public:
    struct Settings {
        std::size_t max_outstanding = 1;  ///< entries under way at once; 0 is taken for 1
        /// Every entry is due once within this time, spread in the same way, so that a slow one has
        /// a value soon; then it takes its turns.
        Duration first_within = 5s;
        /// Turns out of turn (hasten): so many at once, and then one each so often.
        std::size_t extra_burst = 16;
        Duration extra_every = 250ms;
    };
    static constexpr Duration kShortest = 1ms;  ///< shorter intervals are taken for this

    PollSchedule(std::span<const Duration> intervals, TimePoint start, const Settings& settings);

    /// When to call take_due() next. Nothing while as many entries are under way as may be (then
    /// on_done() comes first), and when there are none.
    std::optional<TimePoint> next_due() const;
    /// The entries to start now, the longest due first; they are under way until on_done(). What
    /// max_outstanding holds back stays due.
    std::vector<std::size_t> take_due(TimePoint now);
    /// Wants a turn now besides, as soon as the limits of extra turns allow, behind those who
    /// wanted one before; its next turn will do when that comes first. Of an entry that is under
    /// way: nothing, on_done() comes first.
    void hasten(std::size_t entry, TimePoint now);
    /// A turn besides at this time, unless its next one comes first. Of one that is under way:
    /// nothing.
    void again_at(std::size_t entry, TimePoint when);
    /// This entry has ended, well or not. One that is not under way is ignored.
    void on_done(std::size_t entry, TimePoint now);

    std::size_t outstanding() const { return outstanding_; }
    const ScheduleCounters& counters() const { return counters_; }

  private:
    struct Entry {
        Duration every{};
        Duration phase{};
        TimePoint due;
        bool under_way = false;
        bool hastened = false;  ///< its next turn is one besides
    };
    void set_phases(std::span<const Duration> intervals);
    std::uint64_t advance(std::size_t index, TimePoint now);

    TimePoint start_;
    Settings settings_;
    std::vector<Entry> entries_;
    std::set<std::pair<TimePoint, std::size_t>> queue_;  ///< every entry, by its next turn
    std::size_t outstanding_ = 0;
    TimePoint extra_free_;  ///< when all extra turns are there again
    TimePoint last_extra_;
    ScheduleCounters counters_;
};

}  // namespace panelgate::points
