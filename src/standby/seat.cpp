#include "panelgate/standby/seat.hpp"

namespace panelgate::standby {

void Seat::enter(TimePoint now, Role role, std::string_view why) {
    role_ = role;
    since_ = now;
    why_ = why;
}

std::optional<Deed> Seat::listen(TimePoint now, std::string_view why) {
    heard_ = now;
    if (role_ == Role::listening) return std::nullopt;
    enter(now, Role::listening, why);
    return Deed::listen;
}

std::optional<Deed> Seat::on_line(TimePoint now, bool up) {
    if (up && !up_) heard_ = now;
    up_ = up;
    return up ? std::nullopt : listen(now, "its device cannot be opened");
}

std::optional<Deed> Seat::on_heard(TimePoint now) {
    if (role_ == Role::active) return std::nullopt;  // panels answer this box
    if (role_ == Role::claiming) return std::nullopt;
    deaf_ = false;
    return listen(now, "");
}

/// Rank 0 stays, and lets the box of rank 1 hear a frame, which then leaves.
std::optional<Deed> Seat::on_foreign_request(TimePoint now) {
    if (role_ == Role::active && rank_ == 0) return Deed::keep_alive;
    return listen(now, "another master asks on the line");
}

std::optional<Deed> Seat::on_unanswered(TimePoint now) {
    if (role_ != Role::active) return std::nullopt;
    next_claim_ = now + kLeaves;
    return listen(now, "no panel answers this box, and the other box is there");
}

std::optional<Deed> Seat::on_probed(TimePoint now, bool answered, bool all_tried) {
    if (role_ != Role::claiming) return std::nullopt;
    if (answered) {
        enter(now, Role::active, "the line was silent, and a panel answers");
        deaf_ = false;
        retry_ = kRetry;
        sent_ = now;
        looked_ = now;
        return Deed::drive;
    }
    deaf_ = true;
    next_claim_ = now + (all_tried ? retry_ : kRetry);
    if (all_tried) retry_ = std::min(2 * retry_, kLongestRetry);
    const TimePoint heard = heard_;
    const auto deed = listen(now, "the line is silent, and no panel answers");
    heard_ = heard;  // the line is as silent as before
    return deed;
}

std::optional<Deed> Seat::look(TimePoint now) {
    if (since_ == TimePoint{}) since_ = heard_ = now;
    const bool was_stopped = looked_ != TimePoint{} && now >= looked_ + kStopped;
    looked_ = now;
    if (was_stopped) return listen(now, "this box did not run for a while");
    if (!up_) return std::nullopt;
    switch (role_) {
        case Role::listening:
            return try_to_claim(now);
        case Role::claiming:
            return now >= since_ + kProbe + quiet_ ? on_probed(now, false) : std::nullopt;
        case Role::active:
            break;
    }
    if (now < sent_ + kKeepAlive) return std::nullopt;
    sent_ = now;
    return Deed::keep_alive;
}

std::optional<Deed> Seat::try_to_claim(TimePoint now) {
    const bool peer_is_master = peer_active_ && now < peer_said_ + kPeerCounts;
    const Duration patience = kPatience + quiet_ - kSilence + rank_ * kPatienceOfRank;
    if (now < heard_ + patience || now < next_claim_ || peer_is_master) return std::nullopt;
    enter(now, Role::claiming, "the line is silent");
    return Deed::probe;
}

}  // namespace panelgate::standby
