#include "panelgate/arbiter/read_cache.hpp"

#include <utility>

#include "panelgate/modbus/may_change.hpp"
#include "rules.hpp"

namespace panelgate::arbiter {

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
            return Hit{entry.span == span ? entry.reply
                                          : slice_reply(entry.span.items, entry.reply, span.items),
                       age};
        }
    }
    return std::nullopt;
}

void ReadCache::on_write(TimePoint now, std::uint8_t station, const modbus::Request& request) {
    written_[station] = now;
    const std::optional<modbus::Span> items = request.access().write;
    entries_.remove_if([&](const Entry& entry) {
        return (station == kBroadcast || entry.span.station == station) &&
               modbus::may_change(items, entry.span.items);
    });
}

}  // namespace panelgate::arbiter
