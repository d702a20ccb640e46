#include "panelgate/arbiter/queue/read_cache.hpp"

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"

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

bool WaitingReads::WiderFirst::operator()(const ReadSpan& a, const ReadSpan& b) const {
    return std::tuple(place(a), b.items.count) < std::tuple(place(b), a.items.count);
}

bool WaitingReads::carries(const ReadSpan& span) const {
    const auto behind = widest_.upper_bound(place(span));
    return behind != widest_.begin() && std::prev(behind)->second.contains(span);
}

bool WaitingReads::is_widest(const ReadSpan& span) const {
    const auto found = widest_.find(place(span));
    return found != widest_.end() && found->second == span;
}

void WaitingReads::make_widest(Spans::const_iterator it, const Count& count) {
    const ReadSpan& span = it->first;
    auto inside = widest_.lower_bound(place(span));
    while (inside != widest_.end() && span.contains(inside->second)) {
        count(spans_.find(inside->second)->second.begin()->second, -1);
        inside = widest_.erase(inside);
    }
    widest_.emplace(place(span), span);
    count(it->second.begin()->second, 1);
}

void WaitingReads::add(const Job& job, const ReadSpan& span, const Count& count) {
    const auto [it, first] = spans_.try_emplace(span);
    Equals& equals = it->second;
    if (first) {
        equals.emplace(job.ticket, job.client);
        if (!carries(span)) make_widest(it, count);
        return;
    }
    const Client before = equals.begin()->second;
    equals.emplace(job.ticket, job.client);
    if (equals.begin()->first != job.ticket || !is_widest(span)) return;
    count(before, -1);
    count(job.client, 1);
}

void WaitingReads::remove(const Job& job, const ReadSpan& span, const Count& count) {
    const auto it = spans_.find(span);
    Equals& equals = it->second;
    const bool counted = counts(job.ticket, span);
    equals.erase(job.ticket);
    if (counted) count(job.client, -1);
    if (equals.empty()) {
        drop_span(it, count);
    } else if (counted) {
        count(equals.begin()->second, 1);
    }
}

/// Spans inside the span that goes, and inside no other span, become widest. Of two spans with one
/// beginning the wider span comes first, so that no span is inside a later span.
void WaitingReads::drop_span(Spans::iterator it, const Count& count) {
    const ReadSpan gone = it->first;
    auto next = spans_.erase(it);
    if (!is_widest(gone)) return;
    widest_.erase(place(gone));
    for (; next != spans_.end(); ++next) {
        if (!next->first.same_table(gone) || next->first.items.first >= gone.items.end()) return;
        if (!carries(next->first)) make_widest(next, count);
    }
}

bool WaitingReads::counts(Ticket ticket, const ReadSpan& span) const {
    return is_widest(span) && spans_.find(span)->second.begin()->first == ticket;
}

bool WaitingReads::frees(Ticket ticket, const ReadSpan& span) const {
    if (!counts(ticket, span)) return false;
    auto it = spans_.find(span);
    if (it->second.size() > 1) return false;
    for (++it; it != spans_.end(); ++it) {
        if (!it->first.same_table(span) || it->first.items.first >= span.items.end()) break;
        if (span.contains(it->first)) return false;
    }
    return true;
}

}  // namespace panelgate::arbiter
