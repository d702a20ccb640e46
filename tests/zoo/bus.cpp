#include "bus.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <ctime>
#include <optional>
#include <utility>

#include "reply_shape.hpp"

namespace zoo {
namespace {

constexpr Time kGrain = 100 * kMicrosecond;  // finer than a reader would notice
constexpr Time kPatience = kSecond;
constexpr Time kIdle = 50 * kMillisecond;  // then the other master asks without waiting for a reply

Time character_time(const BusSettings& s) { return s.baud == 0 ? 0 : s.bits * kSecond / s.baud; }

// Serial line V1.02, 2.5.1.1.
Time silent_interval(const BusSettings& s) {
    if (s.baud == 0) return 0;
    return s.baud > 19200 ? 1750 * kMicrosecond : character_time(s) * 7 / 2;
}

Time end_of_frame(const BusSettings& s) {
    return s.baud == 0 ? 20 * kMillisecond : character_time(s) * 7 / 2;
}

}  // namespace

Bus::Bus(BusSettings settings, std::unique_ptr<FarEnd> far_end)
    : settings_(std::move(settings)),
      far_end_(std::move(far_end)),
      wire_(character_time(settings_), static_cast<std::uint32_t>(settings_.index) + 1),
      dice_(static_cast<std::uint32_t>(settings_.index) + 1000),
      ours_(end_of_frame(settings_)),
      theirs_(end_of_frame(settings_)),
      gap_(silent_interval(settings_)),
      wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    if (!settings_.tap.empty()) tap_ = make_pty(settings_.tap);
    tap_ear_.set_latency(settings_.tap_latency);
    for (const int unit : settings_.units) stations_.try_emplace(unit, unit);
    thread_ = std::thread([this] { run(); });
}

Bus::~Bus() {
    is_ending_ = true;
    ::eventfd_write(wake_, 1);
    thread_.join();
    ::close(wake_);
}

void Bus::run() {
    ::prctl(PR_SET_TIMERSLACK, 1);
    while (!is_ending_) {
        wait();
        const std::lock_guard lock(mutex_);
        step(now());
    }
}

void Bus::wait() {
    std::array<pollfd, 3> all{};
    Time until = 0;
    {
        const std::lock_guard lock(mutex_);
        const Time at = now();
        // While everything stands still, what comes is left where it is.
        const bool listens = at >= stopped_until_;
        all = {pollfd{wake_, POLLIN, 0}, pollfd{listens ? far_end_->descriptor() : -1, POLLIN, 0},
               pollfd{listens ? far_end_->listener() : -1, POLLIN, 0}};
        until = std::max<Time>(next_wake(at) - at, 0);
    }
    const timespec pause{until / kSecond, until % kSecond};
    ::ppoll(all.data(), all.size(), &pause, nullptr);
    eventfd_t count = 0;
    ::eventfd_read(wake_, &count);
}

Time Bus::next_wake(Time at) const {
    Time wake = at + kPatience;
    const auto sooner = [&wake](std::optional<Time> other) {
        if (other) wake = std::min(wake, *other);
    };
    sooner(wire_.next(last_step_ + std::max(kGrain, wire_.character())));
    if (far_end_->descriptor() >= 0) sooner(ear_.next());
    if (tap_) sooner(tap_ear_.next());
    for (const Source& s : sources_) sooner(s.next);
    if (other_asks_ != 0) sooner(wire_.busy_until() + kIdle);
    if (stopped_until_ > at) sooner(stopped_until_);
    return wake;
}

void Bus::step(Time at) {
    last_step_ = at;
    if (at >= stopped_until_) {
        if (std::exchange(is_severed_, false)) far_end_->sever(false);
        hear_master(at);
    }
    for (Source& s : sources_) {
        if (s.next <= at) fire(s, at);
    }
    while (const auto c = wire_.passed(at)) on_character(*c);
    if (other_asks_ != 0 && at >= wire_.busy_until() + kIdle) ask_as_other_master(at);
    if (far_end_->descriptor() >= 0) {
        const Bytes heard = ear_.due(at);
        if (!heard.empty()) far_end_->write(heard);
    }
    if (tap_) serve_tap(at);
}

// What comes from it is counted, and nobody hears it.
void Bus::serve_tap(Time at) {
    const Bytes heard = tap_ear_.due(at);
    if (!heard.empty()) tap_->write(heard);
    counters_.tap_bytes += tap_->read().size();
}

void Bus::hear_master(Time at) {
    if (far_end_->listener() >= 0) {
        pollfd waiting{far_end_->listener(), POLLIN, 0};
        if (::poll(&waiting, 1, 0) == 1) {
            far_end_->accept();
            ++counters_.connections;
        }
    }
    if (far_end_->descriptor() < 0) return;
    const Bytes said = far_end_->read();
    if (said.empty()) return;
    const auto echo = shape_echo(habits_[std::min<std::size_t>(said[0], 247)], said.size());
    echo_.insert(echo_.end(), echo.begin(), echo.end());
    wire_.say({.start = at, .speaker = kMaster, .bytes = said});
}

void Bus::on_character(const Character& c) {
    if (tap_) tap_ear_.hear(c.end, c.value);
    if (c.speaker == kMaster) {
        on_master_character(c);
    } else {
        ear_.hear(c.end, c.value, c.hold);
    }
    if (c.speaker == kOtherMaster) {
        if (const auto frame = theirs_.hear(c)) on_frame(*frame, c, false);
    }
    last_activity_ = std::max(last_activity_, c.end);
    const bool is_reply = c.last && c.speaker > 0 && c.speaker < kOtherMaster;
    if (is_reply && other_asks_ != 0) ask_as_other_master(c.end);
}

void Bus::on_master_character(const Character& c) {
    if (ours_.is_at_start(c)) {
        frame_start_ = c.start;
        const Time gap = c.start - last_activity_;
        const bool is_short = last_activity_ != 0 && gap < gap_ - 20 * kMicrosecond;
        if (is_short) ++counters_.gap_violations;
        is_lost_ = is_short && settings_.is_strict;
    }
    if (echoed_ < echo_.size()) {
        const Echo& echo = echo_[echoed_++];
        if (echo.is_heard) ear_.hear(c.end, c.value ^ echo.damage);
        if (echoed_ == echo_.size()) {
            echo_.clear();
            echoed_ = 0;
        }
    }
    if (const auto frame = ours_.hear(c)) on_frame(*frame, c, true);
}

void Bus::speak(const Speech& speech, const char* kind) {
    const Time end = wire_.say(speech);
    note(speech.start, end, kind, speech.bytes);
}

void Bus::note(Time start, Time end, const char* kind, const Bytes& bytes) const {
    if (settings_.log == nullptr) return;
    const auto seconds = [](Time t) {
        return static_cast<double>(t) / static_cast<double>(kSecond);
    };
    std::string line;
    for (const std::uint8_t b : bytes) {
        constexpr std::string_view digits = "0123456789abcdef";
        line += {' ', digits[b >> 4U], digits[b & 0xFU]};
    }
    std::fprintf(settings_.log, "%.6f %.6f %d %s%s\n", seconds(start), seconds(end),
                 settings_.index, kind, line.c_str());
    std::fflush(settings_.log);
}

}  // namespace zoo
