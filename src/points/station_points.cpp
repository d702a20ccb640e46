#include "panelgate/points/station_points.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string_view>
#include <utility>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/points/point.hpp"
#include "panelgate/points/station_polls.hpp"

namespace panelgate::points {

namespace {

using Items = std::vector<std::uint16_t>;

Items bits_in(ByteView packed, std::size_t count) {
    Items items(std::min(count, packed.size() * 8));
    for (std::size_t i = 0; i < items.size(); ++i)
        items[i] = static_cast<std::uint16_t>(packed[i / 8] >> (i % 8) & 1);
    return items;
}

Items words_in(ByteView data) {
    Items items;
    for (Reader in(data); in.left() >= 2;) items.push_back(in.u16());
    return items;
}

/// False only if the panel refused the write.
bool may_have_written(const tap::Transaction& heard) {
    return heard.doubtful || !modbus::exception_of(heard.reply);
}

}  // namespace

Items items_written(ByteView request, std::uint32_t count) {
    constexpr std::size_t kOne = 3;   // function and address
    constexpr std::size_t kMany = 6;  // ... quantity and byte count
    switch (request[0]) {
        case modbus::kWriteSingleCoil:
            return {static_cast<std::uint16_t>(request[kOne] == 0xFF ? 1 : 0)};
        case modbus::kWriteSingleRegister:
            return words_in(request.subspan(kOne));
        case modbus::kWriteMultipleCoils:
            return bits_in(request.subspan(kMany), count);
        case modbus::kWriteMultipleRegisters:
            return words_in(request.subspan(kMany));
        default:
            return {};
    }
}

HeardValues::HeardValues(const std::vector<Want>& wants, SharedMemory memory)
    : wants_(wants), memory_(std::move(memory)), readings_(wants_.size()) {}

std::vector<std::size_t> HeardValues::on_heard(const tap::Transaction& heard) {
    changed_.clear();
    if (!modbus::check_request(heard.request, modbus::QuantityCheck::wide)) return {};
    const modbus::Access access = modbus::access_of(heard.request);
    if (access.write && may_have_written(heard)) apply_write(access.write, heard);
    const bool plain = access.read && heard.request[0] != modbus::kReadFifoQueue;
    if (plain && !heard.doubtful && !apply_read(*access.read, heard))
        apply_failure(*access.read, modbus::exception_of(heard.reply));
    std::ranges::sort(changed_);
    const auto twice = std::ranges::unique(changed_);
    changed_.erase(twice.begin(), twice.end());
    return std::exchange(changed_, {});
}

/// Returns false if the read failed.
bool HeardValues::apply_read(const modbus::Span& span, const tap::Transaction& heard) {
    if (heard.end != tap::End::answered || modbus::exception_of(heard.reply)) return false;
    const Items items = items_of(span, heard.reply);
    if (items.size() < span.count) return false;
    // 17h reads after its own write (AP 6.17).
    const bool writes = heard.request[0] == modbus::kReadWriteMultipleRegisters;
    const TimePoint sampled = writes ? heard.sent : heard.sampled;
    for (std::size_t i = 0; i < wants_.size(); ++i) {
        if (span.contains(wants_[i].span)) set(i, span, items, sampled);
    }
    return true;
}

void HeardValues::apply_write(const std::optional<modbus::Span>& span,
                              const tap::Transaction& heard) {
    for (std::size_t i = 0; i < wants_.size(); ++i) {
        if (!may_change(memory_, span, wants_[i].span)) continue;
        readings_[i].written = heard.sent;
        changed_.push_back(i);
    }
    if (heard.doubtful || heard.end != tap::End::answered) return;
    const Items items = items_written(heard.request, span->count);
    if (items.size() < span->count) return;
    for (std::size_t i = 0; i < wants_.size(); ++i) {
        if (span->contains(wants_[i].span)) set(i, *span, items, heard.sent);
    }
}

void HeardValues::apply_failure(const modbus::Span& span, std::optional<std::uint8_t> exception) {
    for (std::size_t i = 0; i < wants_.size(); ++i) {
        if (!span.contains(wants_[i].span)) continue;
        readings_[i].failing = true;
        readings_[i].exception = exception;
        ++readings_[i].failed;
        changed_.push_back(i);
    }
}

void HeardValues::set(std::size_t want, const modbus::Span& span, const Items& items,
                      TimePoint sampled) {
    const modbus::Span& wanted = wants_[want].span;
    const auto first = items.begin() + static_cast<std::ptrdiff_t>(wanted.first - span.first);
    Reading& reading = readings_[want];
    reading.values.assign(first, first + static_cast<std::ptrdiff_t>(wanted.count));
    reading.sampled = sampled;
    reading.failing = false;
    reading.exception.reset();
    ++reading.good;
    changed_.push_back(want);
}

std::vector<Want> wants_of(const std::vector<Point>& points, const std::vector<Poll>& polls) {
    std::vector<Want> wants;
    wants.reserve(points.size() + polls.size());
    for (const Point& point : points)
        wants.push_back({{point.table, point.address, point.count()}, point.every});
    for (const Poll& poll : polls)
        wants.push_back({{poll.table, poll.address, poll.count}, poll.every});
    return wants;
}

const Point* StationPoints::find(std::string_view name) const {
    const auto found = std::ranges::find(*points_, name, &Point::name);
    return found == points_->end() ? nullptr : &*found;
}

const Point* StationPoints::point_of(std::size_t want) const {
    return want < points_->size() ? &(*points_)[want] : nullptr;
}

const Reading& StationPoints::reading(const Poll& block) const {
    const auto index = static_cast<std::size_t>(&block - blocks_->data());
    return (*readings_)[points_->size() + index];
}

const std::vector<std::uint16_t>& StationPoints::items(const Point& point) const {
    return (*readings_)[static_cast<std::size_t>(&point - points_->data())].values;
}

PointReading StationPoints::read(const Point& point, TimePoint now) const {
    const auto index = static_cast<std::size_t>(&point - points_->data());
    const Reading& reading = (*readings_)[index];
    PointReading made;
    made.quality = quality_of(reading, point.every, now);
    if (reading.sampled) made.age = now - *reading.sampled;
    if (made.quality == Quality::bad) return made;
    made.value = decode(point, reading.values);
    made.label = label_of(point, reading.values);
    if (!made.value) made.quality = Quality::bad;
    return made;
}

bool StationPoints::is_outdated(const Point& point) const {
    return (*readings_)[static_cast<std::size_t>(&point - points_->data())].outdated();
}

namespace {

/// Slot value where the point was bad; real values are finite.
constexpr double kBad = std::numeric_limits<double>::infinity();

}  // namespace

StationHistory::StationHistory(const std::vector<Point>& points, Duration width)
    : points_(&points), width_(width), rings_(width, slots_of(kSpan, width), points.size()) {}

void StationHistory::adopt(const StationHistory& before) {
    if (before.width_ != width_) return;
    std::map<std::string_view, std::size_t> places;
    for (std::size_t i = 0; i < before.points_->size(); ++i)
        places.emplace((*before.points_)[i].name, i);
    for (std::size_t i = 0; i < points_->size(); ++i) {
        const auto found = places.find((*points_)[i].name);
        if (found != places.end() && (*before.points_)[found->second] == (*points_)[i])
            rings_.copy(i, before.rings_, found->second);
    }
}

void StationHistory::record(TimePoint now, const Point& point, const PointReading& reading) {
    if (!keeps(point) || reading.quality == Quality::stale) return;
    const std::size_t ring = ring_of(point);
    if (reading.quality == Quality::bad) return rings_.put(ring, now, kBad);
    const auto value = reading.value ? number_of(*reading.value) : std::nullopt;
    if (value && std::isfinite(*value))
        rings_.put(ring, now - reading.age.value_or(Duration{}), *value);
}

std::vector<HistorySample> StationHistory::samples(const Point& point, TimePoint now) const {
    std::vector<HistorySample> samples;
    const Duration max_pause = std::max(bad_after(point.every), 2 * width_);
    const auto end_before = [&](TimePoint next) {
        if (samples.empty() || !samples.back().value || next - samples.back().at <= max_pause)
            return;
        samples.push_back({samples.back().at + width_, std::nullopt});
    };
    rings_.each(ring_of(point), now, [&](TimePoint at, double value) {
        end_before(at);
        if (std::isfinite(value)) {
            samples.push_back({at, value});
        } else if (samples.empty() || samples.back().value) {
            samples.push_back({at, std::nullopt});
        }
    });
    end_before(now);
    return samples;
}

}  // namespace panelgate::points
