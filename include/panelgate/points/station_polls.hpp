#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/points/read_plan.hpp"

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

/// What is known of the items that somebody wants.
struct Reading {
    std::vector<std::uint16_t> values;  ///< bits are 0 or 1; empty until the first success
    /// When the request for the oldest of them left the gateway's hands; nothing before all of them
    /// were read once.
    std::optional<TimePoint> sampled;
    /// When a write that may have changed them last left: what was asked for before is old.
    std::optional<TimePoint> written;
    bool failing = false;                   ///< the last attempt failed
    std::optional<std::uint8_t> exception;  ///< … with this exception of the panel
    std::uint64_t good = 0;
    std::uint64_t failed = 0;

    /// They have been written since.
    bool outdated() const { return sampled && written && *sampled < *written; }
};

enum class Quality : std::uint8_t { good, stale, bad };
std::string_view label(Quality quality);
/// Good: read within two intervals, not written since, and the last attempt succeeded. Bad: never
/// read, or not for ten intervals and ten seconds. Stale: in between; the value is shown with its
/// age.
Quality quality_of(const Reading& reading, Duration every, TimePoint now);
/// The age at which a value that is to be read so often is bad.
Duration bad_after(Duration every);

/// Each of these wants is given what is known of the same items.
void adopt_readings(const std::vector<Want>& wants, std::vector<Reading>& readings,
                    const std::vector<Want>& known_wants, const std::vector<Reading>& known);

/// What is known of memory that a panel shows in several tables.
struct SharedMemory {
    /// Everything that a write of these items changes; empty: it may change all other tables.
    std::function<std::vector<modbus::Span>(const modbus::Span&)> shown_as;
    /// False: there may be more of it that nobody knows.
    bool known = true;

    /// Does a write of the one change the other? Nothing: that is not known.
    std::optional<bool> changes(const modbus::Span& written, const modbus::Span& items) const;
};

/// Could writing `written` (nothing: anything) change what a read of `items` gives?
bool may_change(const SharedMemory& memory, const std::optional<modbus::Span>& written,
                const modbus::Span& items);

/// Surely not; else they are read again behind the write.
bool spares(const SharedMemory& memory, const std::optional<modbus::Span>& written,
            const modbus::Span& items);

/// Polls of one station: what to read when, from what is wanted, and what came of it. Pure.
class StationPolls {
  public:
    struct Due {
        std::size_t read = 0;  ///< to be given to on_answer(), once
        modbus::Request request;
    };

    /// Wants that the panel cannot serve are never read and stay bad.
    StationPolls(std::vector<Want> wants, PlanLimits limits, TimePoint start,
                 SharedMemory memory = {});

    /// What the one before knew of the same items is known here, too.
    void adopt(const StationPolls& before);
    void apply(SharedMemory memory) { memory_ = std::move(memory); }

    std::vector<Due> take_due(TimePoint now);
    std::optional<TimePoint> next_due() const { return schedule_.next_due(); }
    /// `sampled`: when the request left. Gives the wants that this read was for. A read that the
    /// panel refuses with 02 or 03 is cut in two, until the item that it does not have stands
    /// alone.
    std::vector<std::size_t> on_answer(TimePoint now, std::size_t read, const Result<Bytes>& pdu,
                                       TimePoint sampled);

    /// Somebody writes these items (nothing: any) of the station; the request leaves now. Gives the
    /// wants that are old by that and were not before.
    std::vector<std::size_t> on_write(TimePoint now, const std::optional<modbus::Span>& items);
    /// That is over: what it has made old is read again, the items themselves first, then what it
    /// perhaps has; out of turn as far as the schedule allows.
    void on_written(TimePoint now, const std::optional<modbus::Span>& items);

    const std::vector<Want>& wants() const { return wants_; }
    const Reading& reading(std::size_t want) const { return readings_[want]; }
    /// Of all wants, in their order.
    const std::vector<Reading>& readings() const { return readings_; }
    const std::vector<PlannedRead>& plan() const { return plan_; }
    const ScheduleCounters& counters() const { return schedule_.counters(); }

  private:
    bool take(const PlannedRead& read, ByteView reply, TimePoint sampled);
    void fail(const PlannedRead& read, std::optional<std::uint8_t> exception);
    bool split(TimePoint now, std::size_t read);
    bool is_outdated(const PlannedRead& read) const;

    std::vector<Want> wants_;
    std::vector<Reading> readings_;
    /// Of wants that take several reads: when each of them was done, by its first address.
    std::map<std::size_t, std::map<std::uint32_t, TimePoint>> pieces_;
    std::vector<PlannedRead> plan_;
    PollSchedule schedule_;
    SharedMemory memory_;
};

}  // namespace panelgate::points
