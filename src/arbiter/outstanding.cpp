#include "panelgate/arbiter/outstanding.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/response.hpp"

namespace panelgate::arbiter {

bool Asked::may_be_answered(ByteView reply) const {
    return modbus::answers(pdu, reply, byte_count);
}

namespace {

using By = Asked::By;

bool is_live(const Asked& asked, TimePoint now) { return asked.until > now; }

bool is_ours(const Asked& asked, TimePoint now) {
    return asked.by == By::us && is_live(asked, now);
}

bool is_same(const Asked& asked, ByteView pdu) { return std::ranges::equal(asked.pdu, pdu); }

/// True if the normal reply to this broadcast would confirm the write.
bool confirms(const Asked& broadcast, const modbus::Request& write) {
    return modbus::is_broadcastable(write.function()) &&
           modbus::answers(write.pdu(), modbus::normal_write_reply(broadcast.pdu));
}

/// True for an exception that the real reply may follow (T10; AP 7: acknowledge and busy).
bool announces_reply(ByteView reply) {
    const auto code = modbus::exception_of(reply);
    return code == static_cast<std::uint8_t>(modbus::ExceptionCode::acknowledge) ||
           code == static_cast<std::uint8_t>(modbus::ExceptionCode::server_device_busy);
}

}  // namespace

const Outstanding::Page* Outstanding::find(std::uint8_t station) const {
    return station < pages_.size() ? &pages_[station] : nullptr;
}

Outstanding::Page& Outstanding::page(std::uint8_t station) {
    if (station >= pages_.size()) pages_.resize(station + std::size_t{1});
    return pages_[station];
}

const Asked* Outstanding::answered_by(TimePoint now, std::uint8_t station, ByteView reply,
                                      By by) const {
    const Page* const all = find(station);
    if (all == nullptr) return nullptr;
    const auto found = std::ranges::find_if(all->asked, [&](const Asked& asked) {
        return asked.by == by && is_live(asked, now) && asked.may_be_answered(reply);
    });
    return found == all->asked.end() ? nullptr : &*found;
}

bool Outstanding::is_last_reply(TimePoint now, std::uint8_t station, ByteView reply,
                                Duration within) const {
    return has_last_form(now, station, reply, within) &&
           std::ranges::equal(find(station)->reply, reply);
}

bool Outstanding::has_last_form(TimePoint now, std::uint8_t station, ByteView reply,
                                Duration within) const {
    const Page* const all = find(station);
    return all != nullptr && !all->reply.empty() && now - all->replied <= within &&
           all->reply.size() == reply.size() && all->reply[0] == reply[0];
}

bool Outstanding::any(TimePoint now, std::uint8_t station) const {
    const Page* const all = find(station);
    return all != nullptr &&
           std::ranges::any_of(all->asked, [&](const Asked& asked) { return is_ours(asked, now); });
}

/// An exception names its function alone.
bool Outstanding::may_be_taken(const Asked& asked, const modbus::Request& request, bool again) {
    if (asked.by == By::broadcast) return !request.is_read() && confirms(asked, request);
    return asked.by == By::us && asked.pdu[0] == request.function() &&
           !(again && is_same(asked, request.pdu()));
}

TimePoint Outstanding::clear_at(TimePoint now, std::uint8_t station, const modbus::Request& request,
                                bool again, bool earlier_alone) const {
    TimePoint clear{};
    const Page* const all = find(station);
    if (all == nullptr) return clear;
    for (const Asked& asked : all->asked) {
        const bool earlier = asked.epoch != epoch_ && asked.until != kInTransit;
        if ((earlier || !earlier_alone) && is_live(asked, now) &&
            may_be_taken(asked, request, again))
            clear = std::max(clear, asked.until);
    }
    return clear;
}

bool Outstanding::is_proof(TimePoint now, std::uint8_t station, const modbus::Request& read,
                           bool again) const {
    const Page* const all = find(station);
    return all == nullptr || std::ranges::none_of(all->asked, [&](const Asked& asked) {
               if (!is_ours(asked, now) || asked.pdu[0] != read.function()) return false;
               if (again && is_same(asked, read.pdu())) return false;
               const auto length = modbus::reply_length_from_request(asked.pdu, asked.byte_count);
               return !length || length == read.reply_length();
           });
}

const Asked* Outstanding::last_read(TimePoint now, std::uint8_t station) const {
    const Page* const all = find(station);
    if (all == nullptr) return nullptr;
    const auto found =
        std::find_if(all->asked.rbegin(), all->asked.rend(), [&](const Asked& asked) {
            return is_ours(asked, now) && modbus::read_span(asked.pdu).has_value();
        });
    return found == all->asked.rend() ? nullptr : &*found;
}

TimePoint Outstanding::all_clear_at(TimePoint now, Duration window) const {
    TimePoint clear{};
    for (const Page& all : pages_) {
        for (const Asked& asked : all.asked) {
            if (is_ours(asked, now)) clear = std::max(clear, std::min(asked.until, now + window));
        }
    }
    return clear;
}

TimePoint Outstanding::sampled(TimePoint now, std::uint8_t station, ByteView pdu,
                               TimePoint sent) const {
    const Page* const all = find(station);
    if (all == nullptr) return sent;
    for (const Asked& asked : all->asked) {
        if (is_ours(asked, now) && is_same(asked, pdu)) sent = std::min(sent, asked.sent);
    }
    return sent;
}

/// Beyond the limit of its kind the oldest is forgotten.
void Outstanding::add(std::uint8_t station, Asked asked) {
    PoolVector<Asked>& all = page(station).asked;
    asked.epoch = epoch_;
    std::erase_if(all, [&](const Asked& old) { return !is_live(old, asked.sent); });
    const std::size_t most = asked.by == By::us ? kMost : kMostOthers;
    const auto is_of_kind = [&](const Asked& old) { return old.by == asked.by; };
    if (static_cast<std::size_t>(std::ranges::count_if(all, is_of_kind)) >= most)
        all.erase(std::ranges::find_if(all, is_of_kind));
    all.push_back(std::move(asked));
}

/// Takes out what left over this connection at `sent` or before.
void Outstanding::close(Page& page, unsigned epoch, TimePoint sent) {
    std::erase_if(page.asked, [&](const Asked& asked) {
        return asked.by != By::other_master && asked.epoch == epoch && asked.sent <= sent;
    });
}

void Outstanding::set_last_reply(TimePoint now, std::uint8_t station, ByteView reply) {
    Page& all = page(station);
    all.reply.assign(reply.begin(), reply.end());
    all.replied = now;
}

bool Outstanding::on_reply(TimePoint now, std::uint8_t station, Asked asked, ByteView reply) {
    set_last_reply(now, station, reply);
    Page& all = page(station);
    asked.epoch = epoch_;
    const auto equal = std::ranges::find_if(
        all.asked, [&](const Asked& old) { return is_ours(old, now) && is_same(old, asked.pdu); });
    if (equal == all.asked.end()) {
        close(all, asked.epoch, asked.sent);
        if (announces_reply(reply)) add(station, std::move(asked));
        return true;
    }
    // Over two connections the order is unknown.
    if (equal->epoch == asked.epoch && !announces_reply(reply))
        close(all, asked.epoch, equal->sent);
    add(station, std::move(asked));
    return false;
}

std::optional<Asked> Outstanding::on_late(TimePoint now, std::uint8_t station, ByteView reply,
                                          bool is_open) {
    const Asked* const found = answered_by(now, station, reply);
    if (found == nullptr) return std::nullopt;
    Asked answered = *found;
    set_last_reply(now, station, reply);
    Page& all = page(station);
    const bool is_sure = std::ranges::none_of(all.asked, [&](const Asked& asked) {
        return is_ours(asked, now) && asked.epoch != answered.epoch && asked.may_be_answered(reply);
    });
    if (!is_sure || (is_open && answered.epoch != epoch_)) return answered;
    close(all, answered.epoch, answered.sent);
    if (!announces_reply(reply)) return answered;
    Asked announced = answered;
    announced.until = std::max(answered.until, now + answered.window);
    all.asked.push_back(std::move(announced));
    return answered;
}

void Outstanding::on_other_answered(TimePoint now, std::uint8_t station, ByteView reply) {
    if (const Asked* const found = answered_by(now, station, reply, By::other_master)) {
        PoolVector<Asked>& all = page(station).asked;
        all.erase(all.begin() + (found - all.data()));
    }
}

void Outstanding::on_delivered(TimePoint now, TimePoint sent) {
    for (Page& all : pages_) {
        for (Asked& asked : all.asked) {
            if (asked.until == kInTransit && asked.sent < sent) asked.until = now + asked.window;
        }
    }
}

void Outstanding::forget_other_masters() {
    for (Page& all : pages_)
        std::erase_if(all.asked, [](const Asked& asked) { return asked.by == By::other_master; });
}

void Outstanding::forget(std::uint8_t station) { page(station) = Page(); }

void KnownReads::on_answered(const modbus::Request& read) {
    const modbus::Span& span = *read.span();
    std::uint32_t& items = items_[static_cast<std::size_t>(span.table)];
    items = std::max(items, span.count);
    if (!shortest_ || span.count < shortest_->span()->count) shortest_ = read;
    if (!longest_ || span.count > longest_->span()->count) longest_ = read;
}

std::optional<modbus::Request> KnownReads::longer() const {
    if (!longest_ || only_known_) return std::nullopt;
    modbus::Span span = *longest_->span();
    constexpr std::uint32_t kMost = 100;  // a reply that is not too long for any panel
    if (++span.count > kMost || span.end() > modbus::kTableItems) return std::nullopt;
    return modbus::Request::read(span);
}

modbus::Request KnownReads::probe() const {
    if (shortest_) return *shortest_;
    return wanted_ ? *wanted_ : modbus::Request::read({modbus::Table::holding_registers, 0, 1});
}

}  // namespace panelgate::arbiter
