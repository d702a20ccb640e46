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

/// Schedules the entries of a plan. Entry i has turns at phase + n * interval after the start:
/// there is no drift, and after a stall an entry is due once, not once per lost turn. Entries of
/// the same interval are spread evenly over it, and intervals that divide each other do not
/// coincide. Pure; early and repeated calls are harmless.
class PollSchedule {
  public:
    struct Settings {
        /// Every entry gets its first turn within this time, spread evenly, so that slow entries
        /// have a value soon.
        Duration first_within = 1s;
        /// Limits of extra turns (request_extra_turn): a burst, then one per interval.
        std::size_t extra_burst = 16;
        Duration extra_every = 250ms;
    };
    static constexpr Duration kMinInterval = 1ms;  ///< shorter intervals are raised to this

    PollSchedule(std::span<const Duration> intervals, TimePoint start, const Settings& settings);

    /// Returns when to call take_due() next. nullopt if there are no entries, or if one is in
    /// progress (on_done() comes first).
    std::optional<TimePoint> next_due() const;
    /// Returns the entry to start now, the longest due first; it is in progress until on_done().
    std::optional<std::size_t> take_due(TimePoint now);
    /// Requests an extra turn now, as soon as the limits allow and after earlier requests; the next
    /// regular turn counts if it comes first. Ignored while the entry is in progress.
    void request_extra_turn(std::size_t entry, TimePoint now);
    /// Requests an extra turn at this time, unless the next turn comes first. Ignored while the
    /// entry is in progress.
    void retry_at(std::size_t entry, TimePoint when);
    /// Ends an entry, successful or not. Ignored if it is not in progress.
    void on_done(std::size_t entry, TimePoint now);

  private:
    struct Entry {
        Duration every{};
        Duration phase{};
        TimePoint due;
        bool is_extra = false;  ///< its next turn is an extra one
    };
    void set_phases(std::span<const Duration> intervals);
    void advance(std::size_t index, TimePoint now);

    TimePoint start_;
    Settings settings_;
    std::vector<Entry> entries_;
    std::set<std::pair<TimePoint, std::size_t>> queue_;  ///< all entries by their next turn
    std::optional<std::size_t> under_way_;
    TimePoint extra_free_;  ///< when the whole burst is available again
    TimePoint last_extra_;
};

/// The current reading of a want.
struct Reading {
    std::vector<std::uint16_t> values;  ///< bits are 0 or 1; empty until the first success
    /// When the request for the oldest of the values was sent; nullopt until all were read once.
    std::optional<TimePoint> sampled;
    /// When the last write was sent that may have changed them: earlier reads are outdated.
    std::optional<TimePoint> written;
    bool failing = false;                   ///< the last attempt failed
    std::optional<std::uint8_t> exception;  ///< … with this exception of the panel
    std::uint64_t good = 0;
    std::uint64_t failed = 0;

    /// True if a write came after the values were read.
    bool outdated() const { return sampled && written && *sampled < *written; }
};

/// Returns the items of a good reply to a read of these; bits as 0 and 1.
std::vector<std::uint16_t> items_of(const modbus::Span& span, ByteView reply);

enum class Quality : std::uint8_t { good, stale, bad };
std::string_view label(Quality quality);
/// Good: read within two intervals, not written since, and the last attempt succeeded. Bad: never
/// read, or not for ten intervals and ten seconds. Stale: in between; the value is shown with its
/// age.
Quality quality_of(const Reading& reading, Duration every, TimePoint now);
/// Returns the age at which a value with this interval becomes bad.
Duration bad_after(Duration every);

/// Copies the known readings to the wants of the same items.
void adopt_readings(const std::vector<Want>& wants, std::vector<Reading>& readings,
                    const std::vector<Want>& known_wants, const std::vector<Reading>& known);

/// How the tables of a panel show the same memory.
struct SharedMemory {
    /// Returns the spans whose items change with a write of these items. Empty: the write may
    /// change all other tables.
    std::function<std::vector<modbus::Span>(const modbus::Span&)> shown_as;
    /// False: the panel may share more memory than this.
    bool known = true;

    /// True if a write of `written` changes `items`; nullopt if unknown.
    std::optional<bool> changes(const modbus::Span& written, const modbus::Span& items) const;
};

/// True if writing `written` (nullopt: anything) may change what a read of `items` returns.
bool may_change(const SharedMemory& memory, const std::optional<modbus::Span>& written,
                const modbus::Span& items);

/// True if the write certainly does not change them; otherwise they are read again after it.
bool leaves_unchanged(const SharedMemory& memory, const std::optional<modbus::Span>& written,
                      const modbus::Span& items);

/// Schedules the reads of one station for its wants, and keeps the results. Pure.
class StationPolls {
  public:
    struct Due {
        std::size_t read = 0;  ///< pass to on_answer() once
        modbus::Request request;
    };

    /// Wants that the panel cannot serve are never read and stay bad.
    StationPolls(std::vector<Want> wants, PlanLimits limits, TimePoint start,
                 SharedMemory memory = {});

    /// Takes over the readings of the same items from `before`.
    void adopt(const StationPolls& before);
    void apply(SharedMemory memory) { memory_ = std::move(memory); }

    std::optional<Due> take_due(TimePoint now);
    std::optional<TimePoint> next_due() const { return schedule_.next_due(); }
    /// `sampled`: when the request was sent. Returns the wants of this read. A read refused with 02
    /// or 03 is split until the missing item is read alone.
    std::vector<std::size_t> on_answer(TimePoint now, std::size_t read, const Result<Bytes>& pdu,
                                       TimePoint sampled);

    /// A request that writes these items (nullopt: any) of the station is being sent. Returns the
    /// wants that became outdated.
    std::vector<std::size_t> on_write(TimePoint now, const std::optional<modbus::Span>& items);
    /// The write has ended: schedules reads of what it made outdated, the written items first, then
    /// those it may have changed; as extra turns if the schedule allows.
    void on_written(TimePoint now, const std::optional<modbus::Span>& items);

    const std::vector<Want>& wants() const { return wants_; }
    const Reading& reading(std::size_t want) const { return readings_[want]; }
    /// All readings, in the order of the wants.
    const std::vector<Reading>& readings() const { return readings_; }
    const std::vector<PlannedRead>& plan() const { return plan_; }

  private:
    bool store(const PlannedRead& read, ByteView reply, TimePoint sampled);
    void fail(const PlannedRead& read, std::optional<std::uint8_t> exception);
    bool split(TimePoint now, std::size_t read);
    bool is_outdated(const PlannedRead& read) const;

    std::vector<Want> wants_;
    std::vector<Reading> readings_;
    /// For wants served by several reads: when each read succeeded, by its first address.
    std::map<std::size_t, std::map<std::uint32_t, TimePoint>> pieces_;
    std::vector<PlannedRead> plan_;
    PollSchedule schedule_;
    SharedMemory memory_;
};

}  // namespace panelgate::points
