#include "panelgate/arbiter/read_cache.hpp"

#include <utility>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "rules.hpp"

namespace panelgate::arbiter {
namespace {

/// Could writing `range` change what `span` reads?
bool may_change(const std::optional<modbus::Range>& range, const ReadSpan& span) {
    if (!range) return true;
    const bool holds_coils = span.function == modbus::kReadCoils;
    const bool holds_registers = span.function == modbus::kReadHoldingRegisters;
    const bool same_table = range->table == modbus::Table::coils               ? holds_coils
                            : range->table == modbus::Table::holding_registers ? holds_registers
                                                                               : false;
    if (!same_table) return true;
    const std::uint32_t end = range->address + std::uint32_t{range->count};
    return range->address < span.end() && span.address < end;
}

}  // namespace

void ReadCache::store(const ReadSpan& span, Bytes reply, TimePoint sampled) {
    for (const std::uint8_t station : {span.station, kBroadcast}) {
        const auto written = written_.find(station);
        if (written != written_.end() && written->second >= sampled) return;
    }
    entries_.remove_if([&](const Entry& entry) { return span.contains(entry.span); });
    entries_.push_front({span, std::move(reply), sampled});
    if (entries_.size() > kEntries) entries_.pop_back();
}

std::optional<ReadCache::Hit> ReadCache::find(const ReadSpan& span, TimePoint now,
                                              Duration max_age) const {
    for (const Entry& entry : entries_) {
        const Duration age = now - entry.sampled;
        if (age > max_age) return std::nullopt;
        if (entry.span.contains(span)) {
            return Hit{
                entry.span == span ? entry.reply : slice_reply(entry.span, entry.reply, span), age};
        }
    }
    return std::nullopt;
}

void ReadCache::on_write(TimePoint now, std::uint8_t station, ByteView request) {
    written_[station] = now;
    const std::optional<modbus::Range> range = modbus::access_of(request).write;
    entries_.remove_if([&](const Entry& entry) {
        return (station == kBroadcast || entry.span.station == station) &&
               may_change(range, entry.span);
    });
}

}  // namespace panelgate::arbiter
