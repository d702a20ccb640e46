// What may be sent, and when.

#include <algorithm>

#include "checker.hpp"
#include "panelgate/arbiter/timing.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/read_span.hpp"

namespace panelgate::scenario {

namespace {

constexpr std::size_t kLongestAdu = 256;

}  // namespace

void Checker::on_line_up(TimePoint now) {
    if (started_ == TimePoint{}) started_ = now;
    watch_.on_upset(now);
    sent_until_ = heard_until_ = noisy_since_ = now;
}

void Checker::on_line_down(TimePoint now) {
    if (!attempt_.answered) watch_.on_unanswered(attempt_.station, !attempt_.heard, attempt_.read);
    watch_.on_upset(now);
    attempt_.answered = true;
}

void Checker::on_paused(TimePoint from, TimePoint now) {
    paused_from_ = from;
    resumed_ = now;
    watch_.on_upset(now);
}

void Checker::on_collision(TimePoint now, std::uint8_t station) {
    ++collisions_;
    watch_.on_collision(now, station);
    watch_.on_cost(now, station, settings_of(station).response_timeout);  // at most
}

void Checker::on_heard(TimePoint now, std::size_t bytes) {
    const TimePoint first = now - wire_time(settings_.serial, bytes);
    if (first > std::max(heard_until_, sent_until_) + gap()) noisy_since_ = first;
    heard_until_ = now;
    attempt_.heard = true;
}

void Checker::on_answered(TimePoint now, std::uint8_t station) {
    on_heard(now, 1);
    const auto said = said_.find(station);
    const bool is_its =
        said == said_.end() || modbus::answers(asked_[station], modbus::pdu_of(said->second));
    if (attempt_.answered || attempt_.station != station || !is_its) return;
    // An exception may be that of an earlier request: the wait goes on (T2, T10).
    if (attempt_.owed && said != said_.end() && modbus::exception_of(modbus::pdu_of(said->second)))
        return;
    attempt_.answered = true;
    // The request has left sooner than anybody computes (T7).
    if (!settings_.paced) sent_until_ = std::min(sent_until_, now);
    silent_before_[station] = false;
    silent_to_reads_before_.erase(station);
    replied_[station] = now;
    // Damage, and a confirmation that equals its request, may tell the gateway nothing.
    const bool told = garbled_ < attempt_.started && !attempt_.like_echo;
    const bool is_first = told && watch_.on_answered(now, station);
    // What the way held back may have reached the station only now, and of two attempts nobody
    // knows which one the reply was for.
    if ((is_first && settings_.may_stall) || attempt_.owed) watch_.on_owed(station, owed_until());
    if (watch_.is_good(station, now)) costs_.on_answered(now, attempt_);
}

/// A copy that comes while nothing is asked tells that this station says its replies twice (T12):
/// but not one behind a retry, which may be the reply to that. What comes before in place of the
/// answer to another request is that answer for any gateway, and what it has displaced comes one
/// late; so does what the retry is owed, if the copy is taken for the reply to the retry.
void Checker::on_copy(TimePoint now, ByteView adu) {
    const std::uint8_t station = adu[0];
    const bool awaited = !attempt_.answered && attempt_.station == station;
    const auto said = said_.find(station);
    if (said == said_.end() || !std::ranges::equal(said->second, adu)) return;
    const bool retried = retried_.contains(station);
    // What an outstanding request may have had teaches nothing.
    if (!awaited && !retried && now >= watch_.rests_until(station)) known_doublers_.insert(station);
    if (!awaited && !retried) return;
    // A transport that stalls may hold a copy back for longer than copies are learned (T8).
    const bool held_back = now > said_at_[station] + arbiter::timing::kLongestTrail +
                                     frame_time(settings_.serial, kLongestAdu);
    if (known_doublers_.contains(station) && !held_back) return;
    ++first_copies_;
    if (plan_.limit == Limit::copies_first) return;
    ++excused_;
    excused_from_[station] = now;
}

void Checker::on_reply(TimePoint now, ByteView adu) {
    said_[adu[0]].assign(adu.begin(), adu.end());
    said_at_[adu[0]] = now;
}

/// Bytes without a pause for longer than any frame: nobody's answer, and no reason to wait
/// (LAT-02).
bool Checker::is_noisy(TimePoint now) const {
    return now >= noisy_since_ + frame_time(settings_.serial, kLongestAdu);
}

void Checker::on_transmit(TimePoint now, const Bytes& adu, FrameKind what, bool dead) {
    check_moment(now);
    check_crc(adu);
    close_attempt(now);
    check_idling(now);
    ++frames_;
    const std::uint8_t station = adu[0];
    const ByteView pdu = ByteView(adu).subspan(1, adu.size() - 3);
    check_again(station, pdu, what);
    // A retry belongs to the silence that it follows, whoever was asked between.
    bool& was_silent = silent_before_[station];
    if (what != FrameKind::retry) {
        was_silent = watch_.is_silent(station);
        silent_to_reads_before_.erase(station);
        if (watch_.is_silent_to_reads(station)) silent_to_reads_before_.insert(station);
    }
    if (what == FrameKind::retry) {
        retried_.insert(station);
    } else {
        retried_.erase(station);
    }
    attempt_.was_silent = was_silent;
    const auto [asked, first] = last_asked_.try_emplace(station, now);
    if (!first) {
        longest_unasked_[station] = std::max(longest_unasked_[station], now - asked->second);
        asked->second = now;
    }
    attempt_.station = station;
    attempt_.started = now;
    attempt_.sent = sent_until_ = now + frame_time(settings_.serial, adu.size());
    attempt_.dead = dead;
    attempt_.answered = station == kBroadcast;
    attempt_.heard = false;
    attempt_.read = modbus::is_pure_read(pdu);
    attempt_.like_echo =
        !modbus::is_pure_read(pdu) && std::ranges::equal(modbus::normal_write_reply(pdu), pdu);
    attempt_.span = test::read_span(station, pdu);
    attempt_.again = what == FrameKind::retry;
    asked_[station].assign(pdu.begin(), pdu.end());
    attempt_.owed = now < watch_.rests_until(station);
    last_transmit_ = now;
    const bool write = !modbus::is_pure_read(pdu);
    if (what != FrameKind::retry || !write) check_turn(now, write);
    if (write) check_write_sent(station, pdu);
    mark_sent(station, pdu, what);
    if (write) truth_.on_write_sent(now, station, pdu);
    if (station == kBroadcast) spread_[modbus::normal_write_reply(pdu)] = attempt_.sent;
}

/// A frame whose CRC is in the other order is no frame for its panel; a broadcast can be right for
/// some.
void Checker::check_crc(const Bytes& adu) {
    const auto concerned = [&](const PanelPlan& p) {
        return adu[0] == kBroadcast || p.id == adu[0];
    };
    const auto understands = [&](const PanelPlan& p) {
        return concerned(p) && modbus::crc_ok(adu, p.crc_order);
    };
    if (std::ranges::any_of(plan_.panels, concerned) &&
        std::ranges::none_of(plan_.panels, understands))
        fail("P4: a frame that its panel takes for damage");
}

void Checker::check_moment(TimePoint now) {
    if (now < sent_until_) fail("P5: transmitted while the last frame was still leaving");
    if (now < sent_until_ + gap() || (now < heard_until_ + gap() && !is_noisy(now)))
        fail("P5: transmitted within the silent interval");
    // Without an answer a request is over after its timeout, or when what was heard has ended.
    if (!attempt_.answered && !attempt_.heard && now < sent_until_ + least_wait())
        fail("P1: transmitted while the last request was outstanding");
}

/// T1: each silence is waited for as long as the user has said.
Duration Checker::least_wait() const {
    const arbiter::StationSettings& s = settings_of(attempt_.station);
    return s.adaptive_timeout ? std::min(s.timeout_floor, s.response_timeout) : s.response_timeout;
}

void Checker::close_attempt(TimePoint now) {
    if (attempt_.answered) return;
    const Duration cost = now - attempt_.started;
    const bool wanted = good_work_since(attempt_.started) == attempt_.started;
    const bool plain = calm_ && watch_.only_dies(attempt_.station) && !attempt_.heard;
    if (plain && attempt_.dead && cost > costs_.limit(attempt_) && wanted)
        fail("P4: an attempt at a silent station cost " + std::to_string(cost / 1ms) + " ms");
    const std::string broken = costs_.on_unanswered(now, attempt_, wanted);
    if (!broken.empty()) fail(broken);
    watch_.on_unanswered(attempt_.station, !attempt_.heard, attempt_.read);
    watch_.on_cost(now, attempt_.station, cost);
    watch_.on_owed(attempt_.station, owed_until());
    retry_from_ = now + settings_of(attempt_.station).response_timeout / 2;
}

const arbiter::StationSettings& Checker::settings_of(std::uint8_t station) const {
    const auto listed =
        std::ranges::find(settings_.stations, station, &arbiter::StationSettings::id);
    return listed == settings_.stations.end() ? settings_.unlisted : *listed;
}

/// P1: how long after a request its reply may come, at most.
Duration Checker::latest_reply(std::uint8_t station) const {
    const arbiter::StationSettings& s = settings_of(station);
    constexpr int kMostTimeouts = 8;  // that an automatic window grows to
    return s.response_timeout + s.late_window.value_or(kMostTimeouts * s.response_timeout);
}

/// ... to the request that was sent last: an attempt that hears something goes on until that has
/// ended.
TimePoint Checker::owed_until() const {
    const Duration timeout = settings_of(attempt_.station).response_timeout;
    const TimePoint heard = heard_until_ + settings_.reply_hole - timeout;
    return std::max(attempt_.sent, heard) + latest_reply(attempt_.station);
}

/// P5: what the line may be silent for while a request waits that nothing keeps from going.
void Checker::check_idling(TimePoint now) {
    // Gaps that were lengthened for what follows replies: a copy ends 60 ms and a usual frame
    // behind its reply at most, and is waited for a quarter longer than it has taken.
    constexpr std::size_t kReply = 45;
    const Duration slack = 25ms + (60ms + frame_time(settings_.serial, kReply)) * 5 / 4;
    const TimePoint over = std::max(sent_until_, heard_until_);
    if (now <= over + slack) return;
    const auto waited = good_work_since(over);
    if (!waited || now <= *waited + slack) return;
    const Duration idle = now - *waited;
    longest_idle_ = std::max(longest_idle_, idle);
    Duration most = slack;
    // P8: what equals its request may be the echo, where there are echoes.
    const bool in_doubt = echoes_ && attempt_.like_echo;
    if (!attempt_.answered || in_doubt) most += settings_.unlisted.response_timeout;
    if (attempt_.station == kBroadcast) most += settings_.broadcast_turnaround;
    // A reply of another length is, byte for byte, the late one to an earlier request of that
    // length that had no answer: nobody on the wire can tell. Behind a station that is late the
    // line rests for another timeout and a quarter.
    if (!attempt_.answered && looks_late(attempt_.station))
        most += settings_.unlisted.response_timeout * 5 / 4;
    if (calm_ && idle > most)
        fail("P5: the line was silent for " + std::to_string(idle / 1ms) +
             " ms while a request waited");
}

/// It says replies of other lengths than were asked for.
bool Checker::looks_late(std::uint8_t station) const {
    const auto panel = std::ranges::find(plan_.panels, station, &PanelPlan::id);
    return panel != plan_.panels.end() && panel->padded_inside > 0;
}

/// Since when, but not before `since`, a request has waited that nothing keeps from going: it has
/// not been sent, its station answers everything, and neither owes anything (P1) nor rests, and no
/// older request of its client to that station has to wait. A client's broadcast goes behind its
/// requests to stations that are silent, or rest, and before its later ones.
std::optional<TimePoint> Checker::good_work_since(TimePoint since) const {
    struct Ahead {
        TimePoint any{};                              ///< until when an older request has to wait
        TimePoint broadcast{};                        ///< the same of an older broadcast
        std::map<std::uint8_t, TimePoint> station{};  ///< ... and of requests to this station
    };
    std::unordered_map<arbiter::Client, Ahead> ahead;
    std::optional<TimePoint> first;
    for (const auto& [ticket, o] : open_) {
        if (o.gone) continue;
        const std::uint8_t station = o.job.station;
        const auto [entry, is_new] = ahead.try_emplace(o.job.client);
        Ahead& own = entry->second;
        const auto client = clients_.find(o.job.client);
        if (is_new && client != clients_.end() && client->second.held_until > since)
            own.any = TimePoint::max();
        if (!o.sent && station == kBroadcast) own.broadcast = own.any;
        const bool silent = watch_.is_failing(station);  // a suspect has a share of its own (P4)
        TimePoint& before = own.station[station];
        const TimePoint rest = rests_for(o);
        own.any = silent ? TimePoint::max() : std::max(own.any, rest);
        if (o.sent) continue;
        before = std::max(before, rest);
        if (station == kBroadcast || silent || !watch_.is_good(station, since) ||
            (o.write && echoes_) || own.broadcast == TimePoint::max())
            continue;
        // Two whole timeouts are in advance (P4).
        const TimePoint share = watch_.paid(station) - 8 * settings_of(station).response_timeout;
        const TimePoint from = std::max({since, o.submitted, own.broadcast, before, share});
        if (!first || from < *first) first = from;
    }
    return first;
}

/// T11: until when a panel may answer a broadcast with what would confirm this write.
TimePoint Checker::behind_broadcasts(const Open& open) const {
    const auto found = open.write ? spread_.find(modbus::normal_write_reply(open.job.request.pdu()))
                                  : spread_.end();
    return found == spread_.end() ? TimePoint{} : found->second + latest_reply(open.job.station);
}

/// Until when its station is not asked for it, because of what that has said or may yet say.
TimePoint Checker::rests_for(const Open& open) const {
    const std::uint8_t station = open.job.station;
    const auto announced = announced_.find({station, open.job.request.function()});
    const auto replied = replied_.find(station);
    const Duration pause = settings_of(station).station_gap;
    return std::max({watch_.rests_until(station), behind_broadcasts(open),
                     announced == announced_.end() ? TimePoint{} : announced->second,
                     replied == replied_.end() ? TimePoint{} : replied->second + pause});
}

void Checker::check_write_sent(std::uint8_t station, ByteView pdu) {
    const std::string key = key_of(station, pdu);
    const int most = repeat_writes_.contains(station) ? 1 + settings_.unlisted.retries : 1;
    if (++written_[key] > most) fail("P2: a write was transmitted twice");
    if (closed_writes_.contains(key))
        fail("P2: a write was transmitted after its answer, or for nobody");
    if (!open_writes_.contains(key)) fail("P2: a write that nobody asked for");
}

/// Retries are for those who are there, and not for the silent.
void Checker::check_again(std::uint8_t station, ByteView pdu, FrameKind what) {
    if (what != FrameKind::retry) return;
    if (silent_to_reads_before_.contains(station) && watch_.only_dies(station) && calm_)
        fail("P4: a silent station was asked again at once");
    const auto span = test::read_span(station, pdu);
    const bool wanted = std::ranges::any_of(open_, [&](const auto& entry) {
        const Open& o = entry.second;
        if (o.gone || o.job.station != station) return false;
        const auto& own = o.span;
        return span && own ? span->contains(*own) : std::ranges::equal(o.job.request.pdu(), pdu);
    });
    if (!wanted) fail("P4: a request went out again for nobody");
}

}  // namespace panelgate::scenario
