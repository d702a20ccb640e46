#include "panelgate/arbiter/habits/echo.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::arbiter {

namespace {

/// True if its normal reply can never equal it.
bool differs_from_reply(ByteView pdu) {
    const auto reply = modbus::reply_length_from_request(pdu);
    return reply && (*reply != pdu.size() + modbus::kAduOverhead ||
                     modbus::distinct_byte_count(pdu).has_value());
}

constexpr std::size_t kSingleWrite = 5;  // bytes: function, address, value

}  // namespace

bool teaches_echo(const modbus::Request& request) {
    return request.is_read() && differs_from_reply(request.pdu());
}

bool teaches_echo_of_writes(const modbus::Request& request) {
    return !request.is_read() && differs_from_reply(request.pdu());
}

std::optional<modbus::Request> read_back(ByteView write) {
    if (write.size() < kSingleWrite) return std::nullopt;
    const modbus::Access items = modbus::access_of(write);
    // A mask write (16h) names items, too, but not what they hold then.
    const auto& span = modbus::is_broadcastable(write[0]) ? items.write : items.read;
    if (!span || span->count == 0 || span->end() > modbus::kTableItems) return std::nullopt;
    return modbus::Request::read(*span);
}

bool holds_written(ByteView write, ByteView reply) {
    const auto read = read_back(write);
    if (!read || !modbus::answers(read->pdu(), reply) || modbus::exception_of(reply)) return false;
    if (write[0] == modbus::kWriteSingleCoil) return (reply[2] & 1) == (write[3] != 0 ? 1 : 0);
    if (write[0] == modbus::kWriteMultipleCoils) {
        const std::size_t count = read->span()->count;  // panels need not clear the unused bits
        // From its byte count on it is like the reply to the read.
        return modbus::bits_of(reply, count) == modbus::bits_of(write.subspan(4), count);
    }
    const std::size_t values = write[0] == modbus::kWriteSingleRegister ? 3 : kSingleWrite + 1;
    return std::ranges::equal(write.subspan(values), reply.subspan(2));
}

bool begins_with_request(ByteView heard, ByteView own, const modbus::CrcOrders& orders) {
    const std::size_t size = modbus::request_adu_length(heard);
    return size != 0 && size <= heard.size() && modbus::crc_ok(heard.first(size), orders) &&
           !std::ranges::equal(heard.first(size), own);
}

bool holds_fragment(ByteView heard, ByteView frame) {
    for (std::size_t i = 0; i + 1 < heard.size(); ++i) {
        if (!std::ranges::search(frame, heard.subspan(i, 2)).empty()) return true;
    }
    return false;
}

bool OwnFrame::may_be_echo(const EchoFilter& filter, ByteView pdu) {
    const bool accounted = !possible || filter.complete() || fragment || seen;
    if (accounted || !filter.is_own(pdu)) return false;
    return seen = true;
}

ByteView EchoFilter::feed(ByteView bytes) {
    if (expect_ == Expect::nothing) return bytes;
    std::size_t taken = 0;
    while (taken < bytes.size() && matched_ < frame_.size() && bytes[taken] == frame_[matched_]) {
        ++matched_;
        ++taken;
    }
    const bool certain = expect_ == Expect::certainly;
    if (matched_ == frame_.size()) {
        complete_ = true;
    } else if (taken == bytes.size()) {
        return {};
    } else {
        mismatch_ = certain;
        released_.assign(frame_.begin(), frame_.begin() + static_cast<std::ptrdiff_t>(matched_));
        released_.insert(released_.end(), bytes.begin() + static_cast<std::ptrdiff_t>(taken),
                         bytes.end());
    }
    expect_ = Expect::nothing;
    matched_ = 0;
    return complete_ ? bytes.subspan(taken) : ByteView(released_);
}

std::size_t EchoFilter::missing() const {
    constexpr std::size_t kHeader = 3;  // a reply begins like the request, up to its byte count
    if (expect_ == Expect::nothing || matched_ == 0) return 0;
    const bool open = expect_ == Expect::perhaps && matched_ < kHeader;
    return (open ? kHeader : frame_.size()) - matched_;
}

Bytes EchoFilter::release() {
    if (!pending()) return {};
    expect_ = Expect::nothing;
    return {frame_.begin(),
            frame_.begin() + static_cast<std::ptrdiff_t>(std::exchange(matched_, 0))};
}

EchoMemory::EchoMemory(EchoMode mode) : mode_(mode), state_(EchoState::unknown) { forget(); }

void EchoMemory::forget() {
    heard_ = false;
    missed_ = echoes_ = 0;
    had_none_ = mode_ == EchoMode::off;
    writes_echo_.reset();
    again_at_.reset();
    only_ = habit_ = before_of_ = 0;
    before_ = 0;
    several_ = false;
    missed_by_it_ = missed_by_others_ = 0;
    begin();
}

void EchoMemory::begin() {
    switch (mode_) {
        case EchoMode::automatic:
            state_ = EchoState::unknown;
            return;
        case EchoMode::on:
            state_ = EchoState::present;
            return;
        case EchoMode::off:
            state_ = EchoState::absent;
            return;
    }
    std::abort();
}

EchoFilter::Expect EchoMemory::expect(TimePoint now, const modbus::Request& request) const {
    if (state_ == EchoState::present && !comes_late(now)) return EchoFilter::Expect::certainly;
    // Reads keep looking for an echo: an adapter without one, as configured or learned, may have
    // one.
    if (state_ == EchoState::absent && !teaches_echo(request)) return EchoFilter::Expect::nothing;
    return EchoFilter::Expect::perhaps;
}

bool EchoMemory::must_be_learned_before(const modbus::Request& request, bool tried) const {
    const bool open = state_ == EchoState::unknown || (state_ == EchoState::unclear && !tried);
    return open && !request.is_read();
}

/// A request to this station came back.
void EchoMemory::on_heard_of(std::uint8_t station) {
    if (station == only_) missed_by_it_ = 0;
    if (several_ || station == 0 || station == only_) return;
    several_ = only_ != 0;
    only_ = several_ ? std::uint8_t{0} : station;
    habit_ = 0;
    missed_by_it_ = missed_by_others_ = 0;
}

/// A reply of this station came without.
void EchoMemory::on_missed_by(std::uint8_t station) {
    if (only_ == 0 || mode_ == EchoMode::on) return;
    int& missed = station == only_ ? missed_by_it_ : missed_by_others_;
    if (++missed < kNoMore) return;
    if (station == only_) {
        only_ = habit_ = 0;
        return;
    }
    habit_ = only_;
    state_ = EchoState::absent;
    heard_ = false;
    had_none_ = true;
}

bool EchoMemory::on_echo(const modbus::Request& request, bool expected, std::uint8_t station) {
    if (!teaches_echo(request)) return false;
    if (station == before_of_ && before_ < kNow) before_ = 0;
    on_heard_of(station);
    if (habit_ != 0 && (!expected || repeats(station))) return false;
    if (had_none_ && !expected && state_ != EchoState::present && ++echoes_ < kNow) {
        state_ = EchoState::unknown;
        return false;
    }
    heard_ = true;
    missed_ = 0;
    return std::exchange(state_, EchoState::present) != EchoState::present;
}

void EchoMemory::on_reply_without_echo(const modbus::Request& request, bool fragment,
                                       std::uint8_t station) {
    if (!fragment && teaches_echo(request)) on_missed_by(station);
    if (!fragment && teaches_echo_of_writes(request)) writes_echo_ = false;
    if (state_ == EchoState::present || !teaches_echo(request)) return;
    if (!fragment) {
        echoes_ = 0;
        ++missed_;
    }
    if (state_ == EchoState::absent) {
        had_none_ = had_none_ || missed_ >= kNoMore;
        return;
    }
    if (fragment || heard_) state_ = EchoState::unclear;
    if (!fragment && (!heard_ || missed_ >= kNoMore)) state_ = EchoState::absent;
}

bool EchoMemory::on_again(TimePoint now, ByteView pdu) {
    if (!differs_from_reply(pdu)) return false;
    again_at_ = now;
    return true;
}

void EchoMemory::on_unclear() {
    if (state_ == EchoState::unknown) state_ = EchoState::unclear;
}

void EchoMemory::on_unanswered(const modbus::Request& request) {
    if (mode_ == EchoMode::automatic && !teaches_echo(request)) state_ = EchoState::unclear;
}

void EchoMemory::on_mismatch() {
    if (mode_ != EchoMode::on) begin();
}

std::optional<Duration> LateEcho::delay_of(TimePoint now, ByteView adu) const {
    std::optional<Duration> found;
    for (const Sent& one : sent_) {
        const Duration delay = now - one.at;
        const bool in_time = delay >= timing::kShortestWait && delay < timing::kLatestRepetition;
        if (!in_time || !std::ranges::equal(one.adu, adu)) continue;
        if (!found || is_usual(delay)) found = delay;
    }
    return found;
}

bool LateEcho::is_missing(TimePoint now, ByteView adu) const {
    return std::ranges::any_of(sent_, [&](const Sent& one) {
        return one.missing && now <= one.at + timing::kLatestCopy &&
               std::ranges::equal(one.adu, adu);
    });
}

bool LateEcho::on_heard(TimePoint now, ByteView adu) {
    const auto delay = delay_of(now, adu);
    if (!delay) return false;
    times_ = is_usual(*delay) ? std::min(times_ + 1, kEnough) : 1;
    delay_ = *delay;
    heard_at_ = now;
    return times_ >= kEnough;
}

}  // namespace panelgate::arbiter
