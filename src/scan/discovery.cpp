#include "panelgate/scan/discovery.hpp"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "recogniser.hpp"

namespace panelgate::scan {

Discovery::Discovery(const profile::Catalogue& profiles, DiscoverySettings settings, TimePoint now)
    : profiles_(profiles),
      settings_(std::move(settings)),
      waiting_(settings_.stations.begin(), settings_.stations.end()),
      due_(now),
      began_(now) {}

Discovery::~Discovery() = default;

bool Discovery::done() const { return gave_up() || (waiting_.empty() && recogniser_ == nullptr); }

std::optional<ReadRequest> Discovery::question(TimePoint now) {
    if (done() || now < due_) return std::nullopt;
    if (recogniser_ == nullptr) return ReadRequest::make(waiting_.front(), first_request());
    return ReadRequest::make(examined_.station, *probe_);
}

void Discovery::on_answer(TimePoint now, const Answer& answer) {
    if (done()) return;
    charge(now, answer.cost);
    const bool known =
        recogniser_ != nullptr;  // the station answered before; its next probe stays due
    if (answer.reply == Reply::unsent || (answer.reply == Reply::refused && known)) {
        ++unsent_;
        due_ = std::max(due_, now + kUnsentPause);
        return;
    }
    unsent_ = 0;
    if (answer.reply == Reply::refused) return on_refused(now);
    if (recogniser_ == nullptr) {
        on_first(answer);
    } else {
        on_probe(answer);
    }
}

/// Delays the next question by the full cost, also if this one was sent early.
void Discovery::charge(TimePoint now, Duration cost) {
    const std::chrono::duration<double> whole(to_seconds(cost) / settings_.share);
    due_ = std::max(due_, now - cost) + std::chrono::round<Duration>(whole);
}

void Discovery::on_first(const Answer& answer) {
    const std::uint8_t station = waiting_.front();
    if (answer.reply == Reply::damaged && ++damaged_ < kDamagedTries) return;
    waiting_.pop_front();
    asked_.insert(station);
    if (answer.reply == Reply::silent) {
        damaged_ = 0;  // earlier damage was noise
        silent_.insert(station);
        return;
    }
    silent_.erase(station);
    examined_ = {};
    examined_.station = station;
    examined_.evidence.asked = damaged_ + (answer.reply == Reply::answered ? 1 : 0);
    examined_.evidence.damaged = std::exchange(damaged_, 0);
    examined_.evidence.late = late_.contains(station) ? 1 : 0;
    if (answer.reply != Reply::answered) {
        found_.push_back(std::exchange(examined_, {}));
        return;
    }
    examined_.evidence.good = 1;
    recogniser_ = std::make_unique<Recogniser>(profiles_, station, settings_.format);
    silent_probes_ = 0;
    take_probe();
}

/// Puts the station behind the others, or gives it up.
void Discovery::on_refused(TimePoint now) {
    due_ = std::max(due_, now + kUnsentPause);
    const std::uint8_t station = waiting_.front();
    waiting_.pop_front();
    if (++refusals_[station] < kMaxRefused) return waiting_.push_back(station);
    if (!asked_.contains(station)) ++refused_;
}

std::optional<Duration> Discovery::remaining(TimePoint now) const {
    if (done()) return Duration::zero();
    if (asked_.empty()) return std::nullopt;
    return (now - began_) / static_cast<std::int64_t>(asked_.size()) *
           static_cast<std::int64_t>(waiting_.size());
}

void Discovery::take_probe() {
    while ((probe_ = recogniser_->next_probe())) {
        if (ReadRequest::make(examined_.station, *probe_)) return;
        recogniser_->skip(*probe_);
    }
    end_examination();
}

void Discovery::on_probe(const Answer& answer) {
    ++examined_.evidence.asked;
    if (answer.reply == Reply::damaged) {
        ++examined_.evidence.damaged;
        if (++damaged_ < kDamagedTries) return;
        recogniser_->skip(*probe_);
    } else if (answer.reply == Reply::answered) {
        ++examined_.evidence.good;
        recogniser_->on_reply(*probe_, answer.pdu);
    } else {
        recogniser_->on_reply(*probe_, std::nullopt);
    }
    damaged_ = 0;
    silent_probes_ = answer.reply == Reply::silent ? silent_probes_ + 1 : 0;
    if (silent_probes_ == kSilentProbes) return end_examination();
    take_probe();
}

void Discovery::end_examination() {
    examined_.candidates = recogniser_->candidates();
    found_.push_back(std::exchange(examined_, {}));
    recogniser_.reset();
}

void Discovery::ask_late(std::uint8_t station) {
    if (gave_up() || !silent_.contains(station) || !late_.insert(station).second) return;
    waiting_.push_back(station);
}

std::vector<StationFinding> Discovery::findings() const {
    std::vector<StationFinding> all = found_;
    if (recogniser_ != nullptr) all.push_back(examined_);
    std::ranges::sort(all, {}, &StationFinding::station);
    return all;
}

}  // namespace panelgate::scan
