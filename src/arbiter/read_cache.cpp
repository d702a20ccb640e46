#include "panelgate/arbiter/read_cache.hpp"

#include <utility>
#include <vector>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "rules.hpp"

namespace panelgate::arbiter {

Bytes slice_reply(const modbus::Span& whole, ByteView reply, const modbus::Span& part) {
    const std::size_t first = part.first - whole.first;
    const modbus::Function function = modbus::read_function(part.table);
    if (!modbus::is_bit_table(part.table)) {
        Writer out(2 + std::size_t{2} * part.count);
        out.u8(function).u8(2 * part.count);
        return out.raw(reply.subspan(2 + 2 * first, std::size_t{2} * part.count)).take();
    }
    const std::vector<bool> bits = modbus::bits_of(reply, whole.count);
    const auto begin = bits.begin() + static_cast<std::ptrdiff_t>(first);
    const Bytes packed = modbus::pack_bits(
        std::vector<bool>(begin, begin + static_cast<std::ptrdiff_t>(part.count)));
    Writer out;
    out.u8(function).u8(static_cast<unsigned>(packed.size()));
    return out.raw(packed).take();
}

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
