#include "panelgate/arbiter/outstanding.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "verdict.hpp"

namespace panelgate::arbiter {

namespace {

auto may_be_answered_by(ByteView reply) {
    return
        [reply](const OutstandingReplies::Entry& one) { return modbus::answers(one.pdu, reply); };
}

/// ... and left later than `open`.
auto may_be_answered_since(TimePoint open, ByteView reply) {
    return [open, fits = may_be_answered_by(reply)](const OutstandingReplies::Entry& one) {
        return one.sent > open && fits(one);
    };
}

}  // namespace

void OutstandingReplies::add(TimePoint sent, const Bytes& pdu) {
    entries_.push_back({sent, pdu, false});
    if (entries_.size() > kMost) entries_.pop_front();
}

bool OutstandingReplies::is_only(const Bytes& pdu) const {
    return !empty() &&
           std::ranges::all_of(entries_, [&](const Entry& one) { return one.pdu == pdu; });
}

bool OutstandingReplies::is_ambiguous(const modbus::Request& request, bool again) const {
    const Bytes& pdu = request.pdu();
    const bool is_echoed = modbus::is_broadcastable(pdu[0]);
    const Bytes reply = is_echoed ? modbus::normal_write_reply(pdu) : Bytes{};
    const auto length = modbus::reply_length_from_request(pdu);
    return std::ranges::any_of(entries_, [&](const Entry& one) {
        if (one.pdu[0] != pdu[0] || (again && one.pdu == pdu)) return false;
        return is_echoed ? modbus::answers(one.pdu, reply)
                         : modbus::reply_length_from_request(one.pdu) == length;
    });
}

bool OutstandingReplies::has_other_function(std::uint8_t function) const {
    return std::ranges::any_of(entries_, [&](const Entry& one) { return one.pdu[0] != function; });
}

void OutstandingReplies::close_before(TimePoint sent, TimePoint connected) {
    std::erase_if(entries_, [&](Entry& one) {
        const bool is_before = one.sent < sent && one.sent >= connected;
        if (is_before) remember_closed(std::move(one));
        return is_before;
    });
}

void OutstandingReplies::remember_closed(Entry entry) {
    closed_.push_back(std::move(entry));
    if (closed_.size() > kMost) closed_.pop_front();
}

void OutstandingReplies::lapse() {
    for (Entry& one : entries_) {
        one.lapsed = true;
        remember_closed(std::move(one));
    }
    entries_.clear();
}

bool OutstandingReplies::fits_closed(ByteView reply, TimePoint open) const {
    return std::ranges::any_of(closed_, may_be_answered_since(open, reply));
}

bool OutstandingReplies::fits_closed_by_order(ByteView reply, TimePoint open, ByteView but) const {
    const auto fits = may_be_answered_since(open, reply);
    return std::ranges::any_of(closed_, [&](const Entry& one) {
        return !one.lapsed && !std::ranges::equal(one.pdu, but) && fits(one);
    });
}

OutstandingReplies::Entry OutstandingReplies::take_closed(ByteView reply, TimePoint open) {
    const auto found = std::ranges::find_if(closed_, may_be_answered_since(open, reply));
    Entry taken = std::move(*found);
    closed_.erase(found);
    return taken;
}

void OutstandingReplies::close(ByteView reply, TimePoint connected, bool asked) {
    const auto fits = may_be_answered_by(reply);
    const auto first = std::ranges::find_if(entries_, fits);
    if (first == entries_.end()) return;
    const auto is_present = [&](const Entry& one) { return one.sent >= connected && fits(one); };
    if (first->sent < connected && (asked || std::ranges::any_of(entries_, is_present))) return;
    close_before(first->sent, connected);
    take(reply);
}

bool OutstandingReplies::fits_other(ByteView reply, const Bytes& pdu) const {
    const auto fits = may_be_answered_by(reply);
    return std::ranges::any_of(entries_,
                               [&](const Entry& one) { return one.pdu != pdu && fits(one); });
}

const OutstandingReplies::Entry* OutstandingReplies::oldest(ByteView reply) const {
    const auto found = std::ranges::find_if(entries_, may_be_answered_by(reply));
    return found == entries_.end() ? nullptr : &*found;
}

const OutstandingReplies::Entry* OutstandingReplies::oldest(ByteView reply, TimePoint open) const {
    const Entry* last = nullptr;
    for (const Entry& one : entries_) {
        if (!may_be_answered_by(reply)(one)) continue;
        last = &one;
        if (one.sent > open) break;
    }
    return last;
}

Bytes OutstandingReplies::take(ByteView reply) {
    const auto found = std::ranges::find_if(entries_, may_be_answered_by(reply));
    if (found == entries_.end()) return {};
    Bytes pdu = std::move(found->pdu);
    entries_.erase(found);
    return pdu;
}

void ForeignRequests::on_heard(TimePoint now, ByteView bytes) {
    const ByteView adu = bytes.first(modbus::request_adu_length(bytes));
    if (adu.size() <= modbus::kAduOverhead || adu[0] == kBroadcast) return;
    if (requests_.size() == kMost) requests_.erase(requests_.begin());
    requests_.push_back({now, Bytes(adu.begin(), adu.end())});
}

bool ForeignRequests::fit(ByteView adu, TimePoint since) const {
    return std::ranges::any_of(requests_, [&](const Entry& asked) {
        return asked.at >= since && asked.adu[0] == adu[0] &&
               modbus::answers(modbus::pdu_of(asked.adu), modbus::pdu_of(adu));
    });
}

}  // namespace panelgate::arbiter
