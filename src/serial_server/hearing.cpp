#include "hearing.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/modbus/ascii.hpp"
#include "panelgate/modbus/framing.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/modbus/rtu_request_framer.hpp"

namespace panelgate::serial_server {

namespace {

/// ASCII frames delimit themselves and carry the unit.
class AsciiHearing final : public Hearing {
  public:
    explicit AsciiHearing(const tcp_server::Settings& access)
        : fresh_(access.ascii_digits, access.ascii_pause), framer_(fresh_) {}

    void feed(TimePoint now, ByteView bytes) override { framer_.feed(now, bytes); }
    std::optional<modbus::SerialAdu> next() override { return framer_.next(); }
    void on_silence() override {}
    void drop_pending() override {
        if (framer_.partial()) ++dropped_;
        framer_ = fresh_;
    }
    std::size_t pending() const override { return framer_.partial() ? modbus::kMinAsciiAdu : 0; }
    bool knows_length() const override { return framer_.partial(); }
    void serve(const Units&) override {}  // a frame's ends tell it apart, whoever it is for
    std::size_t take_faults() override {
        return framer_.take_faults() + std::exchange(dropped_, 0);
    }

  private:
    modbus::AsciiFramer fresh_;
    modbus::AsciiFramer framer_;
    std::size_t dropped_ = 0;
};

}  // namespace

std::unique_ptr<Hearing> make_hearing(const Settings& settings, const Units& served) {
    if (settings.access.framing == modbus::Framing::ascii)
        return std::make_unique<AsciiHearing>(settings.access);
    return std::make_unique<RtuHearing>(served);
}

namespace {

using Length = modbus::ReplyLength;

}  // namespace

/// Bytes that announce the rest of a request may go on behind the silence, which is then one of the
/// adapter. Others are over: what comes now begins a frame.
void RtuHearing::feed(TimePoint, ByteView bytes) {
    if (silent_ && missing() < modbus::kReadRequestAdu) to_silence_ = heard_.size();
    silent_ = false;
    heard_.feed(bytes);
}

std::optional<modbus::SerialAdu> RtuHearing::next() {
    while (!heard_.empty()) {
        const Judgement judgement = judge(heard_.view(), aligned_);
        if (judgement.kind == Judgement::Kind::open) break;
        std::size_t wrong = 1;
        if (judgement.kind == Judgement::Kind::frame) {
            const bool is_last = judgement.size == heard_.size();
            const bool counts = aligned_ || !is_for_us(heard_.view()[0]) || (is_last && silent_);
            if (counts && is_acceptable(judgement.size)) return take(judgement.size);
            if (is_last && !silent_) break;
            if (counts) wrong = judgement.size;
        }
        step_over(wrong);
    }
    if (silent_ && heard_.empty()) trust();
    return std::nullopt;
}

/// True if the good frame of `size` bytes at the front may be accepted.
bool RtuHearing::is_acceptable(std::size_t size) const {
    const ByteView frame = heard_.view().first(size);
    return sure() || !is_for_us(frame[0]) || modbus::is_pure_read(modbus::pdu_of(frame));
}

RtuHearing::Judgement RtuHearing::judge(ByteView start, bool aligned) const {
    const Judgement request = check_length(modbus::usual_request_length(start), start, aligned);
    if (request.kind == Judgement::Kind::frame || is_for_us(start[0])) return request;
    const Judgement reply = check_length(modbus::reply_length(start), start, aligned);
    return reply.kind == Judgement::Kind::nothing ? request : reply;
}

RtuHearing::Judgement RtuHearing::check_length(Length length, ByteView start, bool aligned) const {
    using Kind = Judgement::Kind;
    if (length.kind == Length::Kind::need_more)
        return {silent_ && !aligned ? Kind::nothing : Kind::open};
    if (length.kind == Length::Kind::by_silence) {
        const bool may_be = aligned && start.size() <= modbus::kMaxRtuAdu;
        if (may_be && silent_ && modbus::crc_ok(start)) return {Kind::frame, start.size()};
        return {may_be ? Kind::open : Kind::nothing};
    }
    if (length.length > modbus::kMaxLongRtuAdu) return {};
    if (length.length > start.size()) return {Kind::open};
    if (!modbus::crc_ok(start.first(length.length))) return {};
    return {Kind::frame, length.length};
}

void RtuHearing::on_silence() {
    if (heard_.empty()) trust();
    if (std::exchange(silent_, true) || heard_.empty()) return;
    if (!knows_length()) skip_to_last_frame();
}

/// Bytes that the header announces beyond those that are here; 0 if it tells no length. Exceptions
/// are excluded: they are too short to contain a request, and glitches look like them.
std::size_t RtuHearing::missing() const {
    const ByteView all = heard_.view();
    if (all.empty()) return 0;
    const auto rest = [&](const Length& length) -> std::size_t {
        const bool goes_on = length.kind == Length::Kind::known && length.length > all.size() &&
                             length.length <= modbus::kMaxLongRtuAdu;
        return goes_on ? length.length - all.size() : 0;
    };
    const std::size_t request = rest(modbus::request_length(all));
    const bool exception = all.size() > 1 && (all[1] & modbus::kExceptionBit) != 0;
    if (exception || is_for_us(all[0])) return request;
    return std::max(request, rest(modbus::reply_length(all)));
}

/// Skips an incomplete start in favour of a good frame that ends with the last byte received.
bool RtuHearing::skip_to_last_frame() {
    const ByteView all = heard_.view();
    if (all.empty() || judge(all, aligned_).kind == Judgement::Kind::frame) return true;
    for (std::size_t start = 1; start + modbus::kMinAdu <= all.size(); ++start) {
        const Judgement later = judge(all.subspan(start), false);
        if (later.kind != Judgement::Kind::frame || start + later.size != all.size()) continue;
        step_over(start);
        return true;
    }
    return false;
}

modbus::SerialAdu RtuHearing::take(std::size_t size) {
    modbus::SerialAdu adu = modbus::serial_adu_of(heard_.view().first(size));
    trusted_ = sure();
    aligned_ = true;
    consume(size);
    return adu;
}

void RtuHearing::step_over(std::size_t count) {
    if (std::exchange(aligned_, false)) ++faults_;
    if (std::exchange(trusted_, false)) since_lost_ = 0;
    consume(count);
}

void RtuHearing::consume(std::size_t count) {
    heard_.take(count);
    since_lost_ = count == to_silence_ ? 0 : since_lost_ + count;
    to_silence_ -= std::min(to_silence_, count);
}

void RtuHearing::drop_pending() {
    silent_ = true;
    if (skip_to_last_frame()) return;
    step_over(heard_.size());
    trust();
}

std::size_t RtuHearing::take_faults() { return std::exchange(faults_, 0); }

}  // namespace panelgate::serial_server
