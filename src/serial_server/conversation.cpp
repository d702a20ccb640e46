#include "conversation.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/modbus/framing.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::serial_server {
namespace {

/// Bytes that an adapter delivers together (config's reply_hole uses the same).
constexpr std::size_t kChunk = 32;

/// So often a write that may be an echo is answered without the panel, in a row: a master may write
/// the same all the time.
constexpr int kAgain = 4;

Duration lead(const line::Settings& device) {
    const bool switches = device.rs485.mode != line::Rs485::Mode::off;
    return switches ? device.rs485.delay_before_send : Duration::zero();
}

}  // namespace

Conversation::Conversation(const Settings& settings, const Units& served)
    : settings_(settings), served_(served), silence_(silent_interval(settings.device.serial)) {
    reset();
}

void Conversation::reset() {
    hearing_ = make_hearing(settings_, served_);
    was_silent_ = true;
    unframed_bytes_ = 0;
    sent_.reset();
    kept_.clear();
    echo_ = EchoState::unknown;
    confirmed_.reset();
}

void Conversation::serve(const Units& served) {
    served_ = served;
    hearing_->serve(served);
}

void Conversation::on_line_up() { counters_.up = true; }

void Conversation::on_line_down() {
    counters_.up = false;
    supersede();
    reset();
}

/// Bytes are timestamped when read, not when they arrived: a silence before them counts only if
/// on_deadline() found it with no bytes pending.
void Conversation::on_rx(TimePoint now, ByteView bytes) {
    if (!sent_) return hear(now, bytes);
    for (const std::uint8_t byte : bytes) {
        kept_.push_back(byte);
        if (!sent_ || (kept_.size() == 1 && hearing_->pending() > 0) || !begins_echo()) {
            release(now);
        } else if (kept_.size() == sent_->frame.size() && is_echo(now)) {
            sent_.reset();
            kept_.clear();
        } else if (kept_.size() == sent_->frame.size()) {
            sent_.reset();
            release(now);
        }
    }
}

/// True if what is kept begins as the reply that was sent.
bool Conversation::begins_echo() const {
    return kept_.size() <= sent_->frame.size() &&
           std::equal(kept_.begin(), kept_.end(), sent_->frame.begin());
}

/// Judges what has come whole. Where a reply equals its request, its echo is a request by its
/// bytes: an echo by its time, if no master could have asked by then, or as long as the line may
/// have an echo. An echo that has come once may come again, and hides a repeated request once at
/// most.
bool Conversation::is_echo(TimePoint now) {
    const bool sure = sent_->is_distinct || now < sent_->sure_until;
    if (sure) echo_ = EchoState::present;
    return sure || settings_.echo == EchoMode::on || echo_ != EchoState::absent;
}

/// What is kept was the master's.
void Conversation::release(TimePoint now) {
    const Bytes bytes = std::exchange(kept_, {});
    if (!bytes.empty()) hear(now, bytes);
}

void Conversation::hear(TimePoint now, ByteView bytes) {
    last_rx_at_ = now;
    was_silent_ = false;
    unframed_bytes_ += bytes.size();
    hearing_->feed(now, bytes);
    take_frames();
}

void Conversation::take_frames() {
    while (auto adu = hearing_->next()) on_frame(std::move(*adu));
    counters_.damaged += hearing_->take_faults();
}

void Conversation::on_frame(modbus::SerialAdu adu) {
    unframed_bytes_ = hearing_->pending();
    if (adu.station != 0 && served_[adu.station]) return ask(std::move(adu));
    confirmed_.reset();
    supersede();
    if (adu.station != 0) {
        ++counters_.foreign;
    } else if (!finishing_) {
        ++counters_.requests;
        ++counters_.broadcasts;
        actions_.emplace_back(ForwardBroadcast{std::move(adu)});
    }
}

void Conversation::ask(modbus::SerialAdu adu) {
    if (open_ && open_->request == adu) {
        ++counters_.requests;
        ++counters_.repeated;
        open_->ended = last_rx_at_;
        return;
    }
    if (answer_again(adu)) return;
    confirmed_.reset();
    supersede();
    if (finishing_) return;
    ++counters_.requests;
    open_ = Open{next_ticket_++, adu, last_rx_at_};
    actions_.emplace_back(Ask{open_->ticket, std::move(adu)});
}

/// The master has not got the answer, or hears another's, or this is the answer's echo: the panel
/// has done it just now.
bool Conversation::answer_again(const modbus::SerialAdu& adu) {
    if (finishing_ || !confirmed_ || confirmed_->request != adu) return false;
    if (++confirmed_->again > kAgain) return false;
    ++counters_.requests;
    ++counters_.repeated;
    open_ = Open{next_ticket_++, adu, last_rx_at_, confirmed_->reply};
    return true;
}

void Conversation::supersede() {
    if (!open_) return;
    ++counters_.superseded;
    open_.reset();
    actions_.emplace_back(Withdraw{});
}

/// Time after the last byte at which the pending bytes count as complete.
Duration Conversation::pause() const {
    if (settings_.access.framing == modbus::Framing::ascii) return settings_.access.ascii_pause;
    const bool begun = hearing_->pending() >= modbus::kMinAdu || hearing_->knows_length();
    if (!begun) return settings_.glitch + silence_;
    return settings_.hole + wire_time(settings_.device.serial, kChunk);
}

void Conversation::check_silence(TimePoint now) {
    if (now - last_rx_at_ >= silence_ && !std::exchange(was_silent_, true)) {
        hearing_->on_silence();
        take_frames();
        judge_noise();
    }
    if (hearing_->pending() == 0 || now - last_rx_at_ < pause()) return;
    hearing_->drop_pending();
    take_frames();
    judge_noise();
}

/// Damage of at least a frame's length may have been the next request, whose answer a reply would
/// be taken for. Shorter noise is a glitch.
void Conversation::judge_noise() {
    if (hearing_->pending() > 0) return;
    if (unframed_bytes_ > 0 && sent_) sent_->disturbed = true;
    if (std::exchange(unframed_bytes_, 0) >= modbus::kMinAdu) supersede();
}

void Conversation::on_answer(TimePoint now, std::uint64_t ticket, const std::optional<Bytes>& pdu) {
    check_silence(now);
    if (!open_ || open_->ticket != ticket) return;
    if (!pdu) {
        ++counters_.silent;
        open_.reset();
        return;
    }
    open_->is_exception = modbus::exception_of(*pdu).has_value();
    open_->reply = modbus::encode_reply(settings_.access.framing, 0, open_->request.station, *pdu);
    try_send(now);
}

void Conversation::on_deadline(TimePoint now) {
    end_echo(now);
    check_silence(now);
    try_send(now);
}

/// No echo has come. Damage may have been the echo colliding with a transmission of the master.
void Conversation::end_echo(TimePoint now) {
    if (confirmed_ && now >= confirmed_->until) confirmed_.reset();
    if (!sent_ || now < sent_->until) return;
    const bool missing = kept_.empty() && !sent_->disturbed && unframed_bytes_ == 0;
    if (missing && echo_ == EchoState::unknown) echo_ = EchoState::absent;
    sent_.reset();
    release(now);
}

/// If a reply equals its request, its echo looks like a retry. No master has sent one before it
/// could hear the reply.
void Conversation::watch_echo(const Bytes& sent) {
    const modbus::SerialAdu& request = open_->request;
    const Bytes asked =
        modbus::encode_reply(settings_.access.framing, 0, request.station, request.pdu);
    const bool is_distinct = sent != asked;
    const Duration again = silence_ + wire_time(settings_.device.serial, sent.size());
    const TimePoint until = tx_done_at_ + settings_.hole;
    if (settings_.echo != EchoMode::off)
        sent_ = Sent{sent, is_distinct, tx_done_at_ + again, until};
    if (is_distinct) return confirmed_.reset();
    const int before = confirmed_ ? confirmed_->again : 0;
    confirmed_ = Confirmed{request, sent, until, before};
}

/// Waits also for pending bytes that may become a frame.
TimePoint Conversation::may_send_at() const {
    const Duration quiet = hearing_->pending() == 0 ? silence_ : std::max(silence_, pause());
    return std::max(last_rx_at_ + quiet, tx_done_at_ + silence_);
}

void Conversation::try_send(TimePoint now) {
    if (!open_ || !open_->reply || !counters_.up || now < may_send_at()) return;
    const auto limit = settings_.response_timeout;
    if (limit && now - open_->ended >= *limit) {
        ++counters_.late;
        open_.reset();
        return;
    }
    ++counters_.replies;
    if (open_->is_exception) ++counters_.exceptions;
    const Bytes bytes = *std::move(open_->reply);
    tx_done_at_ = now + lead(settings_.device) + wire_time(settings_.device.serial, bytes.size());
    watch_echo(bytes);
    open_.reset();
    actions_.emplace_back(Send{bytes});
}

std::optional<Action> Conversation::poll_action() {
    if (actions_.empty()) return std::nullopt;
    Action first = std::move(actions_.front());
    actions_.pop_front();
    return first;
}

std::optional<TimePoint> Conversation::next_deadline() const {
    std::optional<TimePoint> next;
    const auto add = [&](TimePoint when) { next = next ? std::min(*next, when) : when; };
    if (sent_) add(sent_->until);
    if (confirmed_) add(confirmed_->until);
    if (!was_silent_) add(last_rx_at_ + silence_);
    if (hearing_->pending() > 0) add(last_rx_at_ + pause());
    if (open_ && open_->reply && counters_.up) add(may_send_at());
    return next;
}

}  // namespace panelgate::serial_server
