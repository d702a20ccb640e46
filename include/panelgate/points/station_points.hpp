#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/series.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/points/read_plan.hpp"
#include "panelgate/points/settings.hpp"
#include "panelgate/points/station_polls.hpp"
#include "panelgate/tap/heard.hpp"

namespace panelgate::points {

/// Returns the items that a write (05, 06, 0F, 10) contains, bits as 0 and 1; empty if only the
/// panel knows the result. `count`: items of the write.
std::vector<std::uint16_t> items_written(ByteView request, std::uint32_t count);

/// Values of one station's wants, heard on a line with another master. A read that covers a want
/// completely sets its value, and so does a confirmed write. A doubtful or unconfirmed write makes
/// stale what it may have changed. Pure.
class HeardValues {
  public:
    explicit HeardValues(const std::vector<Want>& wants, SharedMemory memory = {});

    /// Processes a request to this station, or a broadcast, with its result. Returns the changed
    /// wants: read, failed, or outdated.
    std::vector<std::size_t> on_heard(const tap::Transaction& heard);

    /// Takes over the readings of the same items from `before`.
    void adopt(const HeardValues& before) {
        adopt_readings(wants_, readings_, before.wants_, before.readings_);
    }

    const std::vector<Reading>& readings() const { return readings_; }

  private:
    bool apply_read(const modbus::Span& span, const tap::Transaction& heard);
    void apply_write(const std::optional<modbus::Span>& span, const tap::Transaction& heard);
    void apply_failure(const modbus::Span& span, std::optional<std::uint8_t> exception);
    void set(std::size_t want, const modbus::Span& span, const std::vector<std::uint16_t>& items,
             TimePoint sampled);

    std::vector<Want> wants_;
    SharedMemory memory_;
    std::vector<Reading> readings_;
    std::vector<std::size_t> changed_;
};

/// Current state of a point. An old value is never presented as a new one (P10).
struct PointReading {
    std::optional<Value> value;        ///< nullopt if bad, or if the raw value means "no value"
    std::optional<std::string> label;  ///< the label of its raw value
    Quality quality = Quality::bad;
    std::optional<Duration> age;  ///< nullopt if never read

    /// Its value as a number if it is good; nullopt for a text.
    std::optional<double> good_number() const {
        if (!value || quality != Quality::good) return std::nullopt;
        return number_of(*value);
    }
};

/// Returns what to poll for a station: its points in order, then its poll blocks.
std::vector<Want> wants_of(const std::vector<Point>& points, const std::vector<Poll>& polls);

/// The points of one station, from its polled or heard readings. Pure; the arguments outlive it.
class StationPoints {
  public:
    /// `readings` correspond to wants_of(points, blocks).
    StationPoints(const std::vector<Point>& points, const std::vector<Poll>& blocks,
                  const std::vector<Reading>& readings)
        : points_(&points), blocks_(&blocks), readings_(&readings) {}
    StationPoints(const std::vector<Point>& points, const std::vector<Poll>& blocks,
                  const StationPolls& polls)
        : StationPoints(points, blocks, polls.readings()) {}
    /// The same for readings of `source`, which it keeps alive.
    template <class Source>
    StationPoints(const std::vector<Point>& points, const std::vector<Poll>& blocks,
                  std::shared_ptr<const Source> source)
        : StationPoints(points, blocks, source->readings()) {
        owner_ = std::move(source);
    }

    const std::vector<Point>& points() const { return *points_; }
    const Point* find(std::string_view name) const;
    /// Returns the point of this want; null if it belongs to a poll block.
    const Point* point_of(std::size_t want) const;
    PointReading read(const Point& point, TimePoint now) const;
    /// True if a write came after the value was read: the panel may hold another one now.
    bool is_outdated(const Point& point) const;
    /// Returns the raw items: registers, or bits as 0 and 1; empty until the first success.
    const std::vector<std::uint16_t>& items(const Point& point) const;
    const std::vector<Poll>& blocks() const { return *blocks_; }
    /// Returns the reading of a poll block.
    const Reading& reading(const Poll& block) const;

  private:
    const std::vector<Point>* points_;
    const std::vector<Poll>* blocks_;
    const std::vector<Reading>* readings_;
    std::shared_ptr<const void> owner_;  ///< keeps the readings alive
};

/// One value of a point's history.
struct HistorySample {
    TimePoint at;
    std::optional<double> value;  ///< nullopt: unreadable from here on
};

/// One hour of history of a station's points: the last good value per time slot. Memory is fixed:
/// eight bytes per slot and point, 28.8 kB a point with slots of 1 s. Slots are as
/// narrow as kBytes for all points allows: 1 s up to 582 points, 5 s up to 2912. Integers are exact
/// up to 2^53. Pure.
class StationHistory {
  public:
    static constexpr Duration kSpan = 1h;
    static constexpr Duration kNarrowest = 1s;
    static constexpr std::size_t kBytes = 16 * 1024 * 1024;  ///< for all points of the plant

    /// Returns the slot width for this total number of points.
    static Duration width_for(std::size_t points) {
        return slot_width(points, kSpan, kNarrowest, kBytes);
    }
    /// `points` outlive it.
    StationHistory(const std::vector<Point>& points, Duration width);
    /// Takes over what `before` has of identical points.
    void adopt(const StationHistory& before);

    /// Records the current reading of a point. Stale readings are ignored.
    void record(TimePoint now, const Point& point, const PointReading& reading);
    /// False for texts, which have no history.
    static bool keeps(const Point& point) { return point.type != Type::string; }
    /// Returns the samples, oldest first. A sample without a value marks where the point was bad,
    /// or where no value came for long enough to make it bad.
    std::vector<HistorySample> samples(const Point& point, TimePoint now) const;
    Duration width() const { return width_; }

  private:
    std::size_t ring_of(const Point& point) const {
        return static_cast<std::size_t>(&point - points_->data());
    }

    const std::vector<Point>* points_;
    Duration width_;
    SlotRings rings_;  ///< one per point
};

}  // namespace panelgate::points
