#include "panelgate/arbiter/book/outstanding_requests.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/arbiter/book/timing.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_framer.hpp"

namespace panelgate::arbiter {

namespace {

using modbus::kBroadcast;
using State = BookEntry::State;

bool is_outstanding(const BookEntry& one) { return one.state == State::outstanding; }

/// What was announced has had its exception.
bool may_answer(const BookEntry& one, ByteView reply) {
    return !(one.announced && modbus::exception_of(reply)) && modbus::answers(one.pdu, reply);
}

bool is_closed(const BookEntry& one) {
    return one.state == State::passed || one.state == State::lapsed;
}

/// One of ours without its reply, whatever is believed of that.
bool is_unanswered(const BookEntry& one) { return is_outstanding(one) || is_closed(one); }

bool is_recent_reply(const BookEntry& one, TimePoint now) {
    return one.state == State::answered && now - one.replied <= timing::kLatestRepetition;
}

/// True if it may be answered by this, as an outstanding request.
auto outstanding_for(ByteView reply) {
    return [reply](const BookEntry& one) { return is_outstanding(one) && may_answer(one, reply); };
}

auto closed_for(ByteView reply, TimePoint open) {
    return [reply, open](const BookEntry& one) {
        return is_closed(one) && one.sent > open && modbus::answers(one.pdu, reply);
    };
}

/// One of ours that is closed. An earlier attempt of the same read may answer it, unless that was
/// written since; a write is not repeated.
void add_closed(Claims& claims, const BookEntry& one, ByteView reply,
                const OutstandingRequests::Windows& windows, bool is_same_read) {
    const bool closed = one.sent > windows.closed;
    const bool passed =
        one.state == State::passed && one.sent > windows.passed && (!is_same_read || one.outdated);
    if ((!closed && !passed) || !modbus::answers(one.pdu, reply)) return;
    claims.closed = claims.closed || closed;
    claims.passed = claims.passed || passed;
    claims.outdated = claims.outdated || (passed && is_same_read);
}

/// A reply that was given before.
void add_reply(Claims& claims, const BookEntry& one, TimePoint now, ByteView reply, bool is_same) {
    if (!std::ranges::equal(one.reply, reply)) return;
    const bool values = modbus::returns_values(one.pdu) && reply[0] == one.pdu[0];
    const bool recent = is_recent_reply(one, now);
    if (!recent && !(values && now - one.replied <= timing::kLatestCopy)) return;
    claims.repeats_other = claims.repeats_other || !is_same;
    if (!recent) return;
    claims.repeats = true;
    claims.repeated = std::max(claims.repeated, one.replied);
}

/// One entry's part of the claims.
void add_claim(Claims& claims, const BookEntry& one, TimePoint now, ByteView reply,
               const OutstandingRequests::Windows& windows, ByteView open) {
    const bool same = !open.empty() && std::ranges::equal(one.pdu, open);
    const auto fits = [&](TimePoint since) {
        return one.sent >= since && modbus::answers(one.pdu, reply);
    };
    switch (one.state) {
        case State::outstanding:
            if (one.sent <= windows.outstanding || !may_answer(one, reply)) return;
            claims.outstanding = true;
            claims.other_outstanding = claims.other_outstanding || !same;
            return;
        case State::passed:
        case State::lapsed:
            return add_closed(claims, one, reply, windows, same && modbus::is_pure_read(open));
        case State::answered:
            return add_reply(claims, one, now, reply, same);
        case State::refused:
            claims.repeats_refusal = now < one.replied + timing::kLatestRepetition &&
                                     std::ranges::equal(one.reply, reply);
            return;
        case State::foreign:
            claims.other_master = claims.other_master || fits(now - timing::kLatestRepetition);
            claims.contested = claims.contested || (!one.followed && fits(windows.foreign));
            return;
        case State::maybe_foreign:
            claims.contested = claims.contested || fits(windows.contested);
            return;
        case State::damaged:
        case State::broadcast:
            return;
    }
}

}  // namespace

Claims OutstandingRequests::claims(TimePoint now, std::uint8_t station, ByteView reply,
                                   const Windows& windows, ByteView open) const {
    Claims claims;
    for (const BookEntry& one : of(station).asked)
        add_claim(claims, one, now, reply, windows, open);
    if (!open.empty()) return claims;
    const BookEntry* const last = last_reply(station);
    claims.has_last_form = last != nullptr && is_recent_reply(*last, now) &&
                           reply.size() == last->reply.size() && reply[0] == last->reply[0];
    return claims;
}

std::optional<Duration> OutstandingRequests::behind_broadcast(TimePoint now, ByteView reply) const {
    std::optional<Duration> delay;
    for (const BookEntry& one : of(kBroadcast).asked) {
        if (now >= one.sent + timing::kLatestBroadcastAnswer) continue;
        if (!modbus::answers(one.pdu, reply)) continue;
        delay = std::min(delay.value_or(timing::kLatestBroadcastAnswer), now - one.sent);
    }
    return delay;
}

const BookEntry* OutstandingRequests::first(std::uint8_t station, ByteView reply,
                                            TimePoint open) const {
    if (!any(station)) return nullptr;
    const BookEntry* last = nullptr;
    for (const BookEntry& one : of(station).asked) {
        if (!outstanding_for(reply)(one)) continue;
        last = &one;
        if (one.sent > open) break;
    }
    return last;
}

bool OutstandingRequests::has_other_function(std::uint8_t station, std::uint8_t function) const {
    return std::ranges::any_of(of(station).asked, [&](const BookEntry& one) {
        return is_outstanding(one) && one.pdu[0] != function;
    });
}

TimePoint OutstandingRequests::given(std::uint8_t station, TimePoint now, ByteView reply,
                                     TimePoint before) const {
    TimePoint given{};
    for (const BookEntry& one : of(station).asked) {
        if (is_recent_reply(one, now) && one.replied < before &&
            std::ranges::equal(one.reply, reply))
            given = std::max(given, one.replied);
    }
    return given;
}

const BookEntry* OutstandingRequests::last_reply(std::uint8_t station, TimePoint before) const {
    const BookEntry* last = nullptr;
    for (const BookEntry& one : of(station).asked) {
        if (one.state == State::answered && one.replied < before &&
            (last == nullptr || one.replied >= last->replied))
            last = &one;
    }
    return last;
}

const Bytes* OutstandingRequests::given_in(TimePoint now, std::uint8_t station, ByteView bytes,
                                           modbus::CrcOrder order) const {
    for (const BookEntry& one : of(station).asked) {
        if (!is_recent_reply(one, now)) continue;
        const Bytes earlier = modbus::encode_adu(station, one.reply, order);
        if (!std::ranges::search(bytes, earlier).empty()) return &one.reply;
    }
    return nullptr;
}

ByteView OutstandingRequests::late_in(ByteView bytes, const modbus::CrcOrders& orders) const {
    for (; bytes.size() >= modbus::kMinAdu; bytes = bytes.subspan(1)) {
        const std::size_t size = modbus::reply_length(bytes).length;
        if (!any(bytes[0]) || size < modbus::kMinAdu || size > bytes.size()) continue;
        const ByteView adu = bytes.first(size);
        const ByteView pdu = modbus::pdu_of(adu);
        if (first(adu[0], pdu) != nullptr && !modbus::answers(pdu, pdu) &&
            modbus::crc_ok(adu, orders))
            return adu;
    }
    return {};
}

bool OutstandingRequests::any_announced(std::uint8_t station) const {
    return any(station) && std::ranges::any_of(of(station).asked, [](const BookEntry& one) {
               return is_outstanding(one) && one.announced;
           });
}

TimePoint OutstandingRequests::first_sent(std::uint8_t station) const {
    return std::ranges::find_if(of(station).asked, is_outstanding)->sent;
}

TimePoint OutstandingRequests::last_sent(std::uint8_t station) const {
    const PoolVector<BookEntry>& all = of(station).asked;
    return std::find_if(all.rbegin(), all.rend(), is_outstanding)->sent;
}

std::optional<TimePoint> OutstandingRequests::first_asked(std::uint8_t station, ByteView pdu,
                                                          TimePoint open) const {
    for (const BookEntry& one : of(station).asked) {
        if (is_unanswered(one) && one.sent > open && std::ranges::equal(one.pdu, pdu))
            return one.sent;
    }
    return std::nullopt;
}

bool OutstandingRequests::is_only(std::uint8_t station, const Bytes& pdu) const {
    return any(station) && std::ranges::all_of(of(station).asked, [&](const BookEntry& one) {
               return !is_outstanding(one) || one.pdu == pdu;
           });
}

bool OutstandingRequests::is_ambiguous(std::uint8_t station, const modbus::Request& request,
                                       bool again) const {
    if (!any(station)) return false;
    const Bytes& pdu = request.pdu();
    const bool is_echoed = modbus::is_broadcastable(pdu[0]);
    const Bytes reply = is_echoed ? modbus::normal_write_reply(pdu) : Bytes{};
    const auto length = modbus::reply_length_from_request(pdu);
    return std::ranges::any_of(of(station).asked, [&](const BookEntry& one) {
        if (!is_outstanding(one) || one.pdu[0] != pdu[0] || (again && one.pdu == pdu)) return false;
        return is_echoed ? modbus::answers(one.pdu, reply)
                         : modbus::reply_length_from_request(one.pdu) == length;
    });
}

bool OutstandingRequests::came_damaged(std::uint8_t station, const Bytes& pdu) const {
    return std::ranges::any_of(of(station).asked, [&](const BookEntry& one) {
        return one.state == State::damaged && one.pdu == pdu;
    });
}

TimePoint OutstandingRequests::broadcasts_over(const modbus::Request& request, Duration window,
                                               bool refuses) const {
    TimePoint over{};
    if (request.is_read()) return over;
    for (const BookEntry& one : of(kBroadcast).asked) {
        const bool same = refuses && one.pdu[0] == request.function();
        if (same || modbus::answers(request.pdu(), one.reply))
            over = std::max(over, one.sent + window);
    }
    return over;
}

void OutstandingRequests::on_unanswered(std::uint8_t station, TimePoint sent, const Bytes& pdu,
                                        bool announced) {
    enter(at(station), {.sent = sent, .pdu = pdu, .announced = announced}, most_);
}

void OutstandingRequests::announce(std::uint8_t station, ByteView exception) {
    PoolVector<BookEntry>& all = at(station).asked;
    const auto found = std::ranges::find_if(all, outstanding_for(exception));
    if (found != all.end()) found->announced = true;
}

void OutstandingRequests::on_written(std::uint8_t station, ByteView write) {
    const std::optional<modbus::Span> items = modbus::access_of(write).write;
    const auto mark = [&](Page& page) {
        for (BookEntry& one : page.asked) {
            if (!is_unanswered(one)) continue;
            const auto read = modbus::read_span(one.pdu);
            one.outdated = one.outdated || !read || modbus::may_change(items, *read);
        }
    };
    if (station != kBroadcast) return mark(at(station));
    for (Page& page : pages_) mark(page);
}

void OutstandingRequests::on_damaged(std::uint8_t station, TimePoint sent, const Bytes& pdu) {
    enter(at(station), {.state = State::damaged, .sent = sent, .pdu = pdu}, 1);
}

void OutstandingRequests::forget_damaged(std::uint8_t station) {
    std::erase_if(at(station).asked,
                  [](const BookEntry& one) { return one.state == State::damaged; });
}

void OutstandingRequests::on_reply(std::uint8_t station, TimePoint now, const Bytes& pdu,
                                   ByteView reply) {
    BookEntry one{.state = State::answered,
                  .pdu = pdu,
                  .replied = now,
                  .reply = Bytes(reply.begin(), reply.end())};
    Page& page = at(station);
    if (BookEntry* const old = oldest_reply(page, pdu[0])) {
        *old = std::move(one);
    } else {
        page.asked.push_back(std::move(one));
    }
}

/// The reply that is forgotten for one to `function`; null: there is room. Beyond the last ones the
/// last to each function is kept: a panel may have a buffer for each, and says that once more.
BookEntry* OutstandingRequests::oldest_reply(Page& page, std::uint8_t function) {
    std::size_t count = 0;
    BookEntry* oldest = nullptr;
    BookEntry* oldest_repeated = nullptr;  // a later one has its function
    const auto take_older = [](BookEntry*& old, BookEntry& other) {
        if (old == nullptr || other.replied < old->replied) old = &other;
    };
    const auto is_later = [](const BookEntry& one, const BookEntry& other) {
        return one.state == State::answered && one.pdu[0] == other.pdu[0] &&
               one.replied > other.replied;
    };
    for (BookEntry& other : page.asked) {
        if (other.state != State::answered) continue;
        ++count;
        take_older(oldest, other);
        const bool repeated =
            other.pdu[0] == function || std::ranges::any_of(page.asked, [&](const BookEntry& one) {
                return is_later(one, other);
            });
        if (repeated) take_older(oldest_repeated, other);
    }
    if (count < kReplies) return nullptr;
    const auto is_recent = [&](const BookEntry& which) {
        return std::ranges::count_if(page.asked, [&](const BookEntry& one) {
                   return one.state == State::answered && one.replied > which.replied;
               }) < static_cast<std::ptrdiff_t>(kReplies) - 1;
    };
    if (oldest_repeated != nullptr && !is_recent(*oldest_repeated)) return oldest_repeated;
    return count < 2 * kReplies ? nullptr : oldest;
}

bool OutstandingRequests::on_followed(std::uint8_t station) {
    const BookEntry* const last = last_reply(station);
    PoolVector<BookEntry>& all = at(station).asked;
    for (BookEntry& one : all) one.followed = one.followed || &one == last;
    return std::ranges::count_if(all, &BookEntry::followed) >= 2;
}

void OutstandingRequests::on_refusal(std::uint8_t station, TimePoint now, ByteView reply) {
    Page& page = at(station);
    if (std::ranges::any_of(page.asked, [&](const BookEntry& one) {
            return one.state == State::refused && std::ranges::equal(one.reply, reply) &&
                   now < one.replied + timing::kLatestRepetition;
        }))
        return;
    const Bytes said(reply.begin(), reply.end());
    enter(page, {.state = State::refused, .replied = now, .reply = said}, 1);
}

void OutstandingRequests::on_foreign(TimePoint now, ByteView bytes, bool maybe) {
    const ByteView adu = bytes.first(modbus::request_adu_length(bytes));
    if (adu.size() <= modbus::kAduOverhead || adu[0] == kBroadcast) return;
    const ByteView pdu = modbus::pdu_of(adu);
    enter(at(adu[0]),
          {.state = maybe ? State::maybe_foreign : State::foreign,
           .sent = now,
           .pdu = Bytes(pdu.begin(), pdu.end()),
           .followed = bytes.size() > adu.size()},
          kForeign);
}

bool OutstandingRequests::on_foreign_answered(std::uint8_t station, ByteView reply) {
    BookEntry* oldest = nullptr;
    for (BookEntry& one : at(station).asked) {
        if (one.state != State::foreign || one.followed || !modbus::answers(one.pdu, reply))
            continue;
        if (oldest == nullptr || one.sent < oldest->sent) oldest = &one;
    }
    if (oldest != nullptr) oldest->followed = true;
    return oldest != nullptr;
}

void OutstandingRequests::on_foreign_over(std::uint8_t station) {
    for (BookEntry& one : at(station).asked)
        one.followed = one.followed || one.state == State::foreign;
}

void OutstandingRequests::on_broadcast(TimePoint sent, const Bytes& pdu) {
    on_written(kBroadcast, pdu);
    enter(at(kBroadcast),
          {.state = State::broadcast,
           .sent = sent,
           .pdu = pdu,
           .reply = modbus::normal_write_reply(pdu)},
          kBroadcasts);
}

void OutstandingRequests::pass(std::uint8_t station, TimePoint sent) {
    if (any(station)) close(at(station), State::passed, opened_, sent);
}

void OutstandingRequests::close(std::uint8_t station, ByteView reply, bool asked) {
    const BookEntry* const oldest = first(station, reply);
    if (oldest == nullptr) return;
    const auto is_present = [&, fits = outstanding_for(reply)](const BookEntry& one) {
        return one.sent >= opened_ && fits(one);
    };
    if (oldest->sent < opened_ && (asked || std::ranges::any_of(of(station).asked, is_present)))
        return;
    pass(station, oldest->sent);
    take(station, reply);
}

void OutstandingRequests::take(std::uint8_t station, ByteView reply) {
    Page& page = at(station);
    const auto found = std::ranges::find_if(page.asked, outstanding_for(reply));
    if (found == page.asked.end()) return;
    page.asked.erase(found);
    --page.outstanding;
}

BookEntry OutstandingRequests::take_closed(std::uint8_t station, ByteView reply, TimePoint open) {
    Page& page = at(station);
    const auto found = std::ranges::find_if(page.asked, closed_for(reply, open));
    BookEntry taken = std::move(*found);
    page.asked.erase(found);
    return taken;
}

bool OutstandingRequests::take_first_of_two(std::uint8_t station, ByteView reply, TimePoint open) {
    PoolVector<BookEntry>& all = at(station).asked;
    const auto was_answered_so = [&](const BookEntry& first) {
        const auto second = std::ranges::find_if(all, [&](const BookEntry& one) {
            return one.state == State::answered && first.sent < one.replied && one.pdu == first.pdu;
        });
        return second != all.end() && std::ranges::equal(second->reply, reply);
    };
    const auto is_closed = closed_for(reply, open);
    const auto found = std::ranges::find_if(
        all, [&](const BookEntry& one) { return is_closed(one) && was_answered_so(one); });
    if (found == all.end()) return false;
    all.erase(found);
    return true;
}

void OutstandingRequests::lapse(std::uint8_t station, TimePoint before) {
    if (any(station)) close(at(station), State::lapsed, TimePoint::min(), before);
}

void OutstandingRequests::settle(std::uint8_t station) {
    Page& page = at(station);
    std::erase_if(page.asked, is_outstanding);
    page.outstanding = 0;
}

void OutstandingRequests::forget_foreign() {
    for (Page& page : pages_)
        std::erase_if(page.asked, [](const BookEntry& one) { return one.state == State::foreign; });
}

void OutstandingRequests::forget(std::uint8_t station) { at(station) = {}; }

const OutstandingRequests::Page& OutstandingRequests::of(std::uint8_t station) const {
    static const Page kEmpty;
    return station < pages_.size() ? pages_[station] : kEmpty;
}

OutstandingRequests::Page& OutstandingRequests::at(std::uint8_t station) {
    if (station >= pages_.size()) pages_.resize(std::size_t{station} + 1);
    return pages_[station];
}

void OutstandingRequests::enter(Page& page, BookEntry one, std::size_t most) {
    std::size_t count = 0;
    BookEntry* oldest = nullptr;
    for (BookEntry& other : page.asked) {
        if (other.state != one.state) continue;
        ++count;
        if (oldest == nullptr || other.since() < oldest->since()) oldest = &other;
    }
    if (count >= most && !is_outstanding(one)) {
        *oldest = std::move(one);  // only those have an order
        return;
    }
    if (count >= most) take_first(page);
    page.outstanding += is_outstanding(one) ? 1 : 0;
    page.asked.push_back(std::move(one));
}

void OutstandingRequests::take_first(Page& page) {
    page.asked.erase(std::ranges::find_if(page.asked, is_outstanding));
    --page.outstanding;
}

void OutstandingRequests::close(Page& page, State state, TimePoint since, TimePoint before) {
    for (BookEntry& one : page.asked) {
        if (!is_outstanding(one) || one.sent < since || one.sent >= before) continue;
        if (one.announced && state == State::passed) continue;
        one.state = state;
        --page.outstanding;
    }
    while (std::cmp_greater(std::ranges::count_if(page.asked, is_closed), kMost))
        page.asked.erase(std::ranges::find_if(page.asked, is_closed));
}

}  // namespace panelgate::arbiter
