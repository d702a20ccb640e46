// Who waits, and whose turn it is.

#include <algorithm>
#include <tuple>
#include <utility>
#include <vector>

#include "checker.hpp"
#include "support/read_span.hpp"

namespace panelgate::scenario {

/// What goes with this frame: what it contains and may run, nothing older of its client waiting for
/// that station, nor a broadcast. What was sent before and is not this frame waits again.
void Checker::mark_sent(std::uint8_t station, ByteView pdu, FrameKind what) {
    if (what != FrameKind::request && what != FrameKind::broadcast)
        return;  // it answers nobody, or the same again
    const auto span = test::read_span(station, pdu);
    std::unordered_set<arbiter::Client> behind;  // those whose order lets no more go
    for (auto& [ticket, open] : open_) {
        const bool concerned = open.job.station == station || open.job.station == kBroadcast;
        if (open.gone || !concerned) continue;
        const auto& own = open.span;
        const bool goes = span && own ? span->contains(*own)
                                      : open.job.station == station &&
                                            std::ranges::equal(open.job.request.pdu(), pdu);
        const bool taken = goes && (open.sent || !behind.contains(open.job.client));
        open.again = open.sent && !taken;
        open.sent = open.sent || taken;
        if (!taken) behind.insert(open.job.client);
    }
}

/// All that went with the frame are answered in the same moment.
void Checker::mark_answered(std::uint8_t station) {
    for (auto& [ticket, open] : open_)
        open.again = open.again || (open.sent && open.job.station == station);
}

/// A read that comes while one which contains it is still leaving goes along with it, unless
/// something older of its client waits for that station: on a line that keeps pace. On another one
/// nobody knows that the request has not left.
bool Checker::joins_attempt(TimePoint now, const arbiter::Job& job) const {
    const auto own = test::read_span(job.station, job.request.pdu());
    const bool held_back = settings_.paced && settings_.share_reads;
    const Duration spare = (attempt_.sent - attempt_.started) / 50;  // a rate that is off
    const bool leaving = held_back && now < attempt_.sent - spare && !attempt_.again;
    if (!leaving || !own || !attempt_.span || !attempt_.span->contains(*own)) return false;
    return std::ranges::none_of(open_, [&](const auto& entry) {
        const Open& o = entry.second;
        return !o.sent && !o.gone && o.job.client == job.client &&
               (o.job.station == job.station || o.job.station == kBroadcast);
    });
}

namespace {

/// Sorts by table, where it begins, and the wider ones first.
std::uint64_t rank_of(const arbiter::ReadSpan& span) {
    constexpr std::uint64_t kMost = 0xFFFF;
    const auto table = static_cast<std::uint64_t>(span.items.table);
    return std::uint64_t{span.station} << 40 | table << 32 | std::uint64_t{span.items.first} << 16 |
           (kMost - span.items.count);
}

}  // namespace

/// Of reads that one transaction answers in any case only one counts: a read that another contains
/// rides. An unanswered read whose frame was sent may wait all the same, because the frame was a
/// proof, or no read rode along with it (T2): it does not count, and reads that it contains ride.
/// Reads that only touch are joined as far as a panel is known to take the length, which is not
/// known here: they count.
std::size_t Checker::waiting(arbiter::Ticket but_for) const {
    std::size_t waiting = 0;
    std::vector<std::pair<std::uint64_t, bool>> reads;  // and whether it counts
    reads.reserve(open_.size());
    for (const auto& [ticket, open] : open_) {
        if (open.gone || ticket == but_for) continue;
        const bool waits = !open.sent || open.again;
        if (open.span && settings_.share_reads) {
            reads.emplace_back(rank_of(*open.span), waits);
        } else if (waits) {
            ++waiting;
        }
    }
    std::ranges::sort(reads);
    std::uint64_t table = 0;
    std::uint64_t end = 0;
    for (const auto& [read, waits] : reads) {
        if (std::exchange(table, read >> 32) != read >> 32) end = 0;
        const std::uint64_t own = (read >> 16 & 0xFFFF) + 0xFFFF - (read & 0xFFFF);
        if (own > end && waits) ++waiting;
        end = std::max(end, own);
    }
    return waiting;
}

/// A newcomer may not raise what waits beyond the limit. More than it may wait all the same: what
/// was taken for a joined read and refused by the panel waits again, and what rode along with a
/// read that has gone counts again, when it was behind something older of its own client. A
/// newcomer takes somebody's place then. Where a frame has left in the same moment nobody can tell
/// which it was.
void Checker::on_settled() {
    const bool came = std::exchange(came_, false);
    const bool gone = std::exchange(frames_settled_, frames_) != frames_;
    if (!came || gone || displaced_ || open_.size() <= settings_.queue.limit) return;
    const auto newcomer = open_.find(last_ticket_);
    if (newcomer == open_.end()) return;
    const std::size_t after = waiting();
    if (after > settings_.queue.limit && after > waiting(last_ticket_))
        fail("P9: more requests wait than the limit allows: " + std::to_string(after) + " of " +
             std::to_string(settings_.queue.limit));
}

/// P9: a waiting reader gets every fifth turn at least, unless its station rests, for what it owes
/// (P1) or as its settings say, or has not answered when it was asked last, or lately too often:
/// then it has a share of its own (P4). Behind a silence those go first who waited before. A write
/// that is repeated takes no other turn.
void Checker::check_turn(TimePoint now, bool write) {
    constexpr std::uint64_t kWritesInARow = 4;
    constexpr std::size_t kRemembered = 8;
    ++turns_;
    last_turns_.push_back(now);
    if (last_turns_.size() > kRemembered) last_turns_.pop_front();
    if (!write) {
        last_read_turn_ = turns_;
        return;
    }
    if (turns_ - last_read_turn_ <= kWritesInARow) return;
    const TimePoint first = last_turns_[last_turns_.size() - 1 - kWritesInARow];
    const auto starves = std::ranges::find_if(open_, [&](const auto& entry) {
        const Open& o = entry.second;
        const auto client = clients_.find(o.job.client);
        return !o.sent && !o.gone && o.job.priority == PriorityClass::read &&
               o.turn + kWritesInARow < turns_ && client != clients_.end() &&
               client->second.single && watch_.is_good(o.job.station, o.submitted) &&
               !watch_.is_failing(o.job.station) && rests_for(o) <= first &&
               watch_.paid(o.job.station) <= first && retry_from_ <= first;
    });
    if (starves != open_.end())
        fail("P9: five writes in a row while a reader waits: " + std::to_string(starves->first));
}

}  // namespace panelgate::scenario
