// What may be sent, and when.

#include <algorithm>

#include "checker.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/read_span.hpp"

namespace panelgate::scenario {

namespace {

constexpr std::size_t kLongestAdu = 256;

/// True for two writes to one place: of their values the confirmation says nothing.
bool are_confirmed_alike(ByteView before, ByteView pdu) {
    const auto is_longer_write = [](ByteView request) {
        return !request.empty() && (request[0] == modbus::kWriteMultipleCoils ||
                                    request[0] == modbus::kWriteMultipleRegisters);
    };
    return is_longer_write(before) && is_longer_write(pdu) &&
           modbus::normal_write_reply(before) == modbus::normal_write_reply(pdu);
}

}  // namespace

void Checker::on_line_up(TimePoint now) {
    if (started_ == TimePoint{}) started_ = now;
    watch_.on_upset(now);
    sent_until_ = heard_until_ = noisy_since_ = now;
}

void Checker::on_line_down(TimePoint now) {
    if (!attempt_.answered) watch_.on_unanswered(now, attempt_.station, !attempt_.heard);
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
}

void Checker::on_heard(TimePoint now, std::size_t bytes) {
    const TimePoint first = now - wire_time(settings_.serial, bytes);
    if (first > std::max(heard_until_, sent_until_) + gap()) noisy_since_ = first;
    heard_until_ = now;
    attempt_.heard = true;
    attempt_.bytes += bytes;
}

void Checker::on_answered(TimePoint now, std::uint8_t station) {
    on_heard(now, 1);
    const auto missed = missed_.find(station);
    if (missed != missed_.end()) missed->second.heard = std::min(missed->second.heard, now);
    const auto said = said_.find(station);
    const bool is_its =
        said == said_.end() || modbus::answers(asked_[station], modbus::pdu_of(said->second));
    if (attempt_.answered || attempt_.station != station || !is_its) return;
    attempt_.answered = true;
    if (said != said_.end() && attempt_.bytes > said->second.size())
        behind_damage_[station] = now + 150ms;
    missed_.erase(station);
    silent_before_[station] = false;
    replied_[station] = now;
    const auto size = modbus::reply_length_from_request(asked_[station]).value_or(0);
    // What equals its request, and comes when nobody waits for it, shows nothing: see
    // may_be_echo().
    const bool shows =
        !may_be_echo(station) || open_writes_.contains(key_of(station, asked_[station]));
    Duration& latest = begun_after_[station];
    if (shows) latest = std::max(latest, now - attempt_.sent - frame_time(settings_.serial, size));
    attempt_.first = !watch_.has_answered(attempt_.station);
    const bool is_first = shows && watch_.on_answered(now, attempt_.station, now - attempt_.sent);
    // What the way held back may have reached the station only now.
    if (is_first && settings_.may_stall) watch_.on_owed(attempt_.station, owed_until());
    // Of two attempts nobody knows which one the reply was for.
    if (attempt_.owed) watch_.on_owed(attempt_.station, owed_until());
    if (watch_.is_good(attempt_.station, now)) costs_.on_answered(now, attempt_);
}

/// A copy tells that this station says its replies twice: but not one of a reply that nobody has
/// heard whole, which is the reply, nor one behind a retry, which may be the reply to that. The
/// first one that comes in place of the answer to another request is found by asking once more.
/// Where the very same is asked again it is that answer for any gateway, and what it has displaced
/// comes one late: see Checker.
void Checker::on_copy(TimePoint now, ByteView adu) {
    const std::uint8_t station = adu[0];
    const bool awaited = !attempt_.answered && attempt_.station == station;
    if (!awaited && retried_.contains(station)) return;
    doublers_.insert(station);
    const auto said = said_.find(station);
    if (said == said_.end() || !std::ranges::equal(said->second, adu)) return;
    if (!awaited) known_doublers_.insert(station);
    if (!awaited || known_doublers_.contains(station)) return;
    ++first_copies_;
    ++excused_;
    excused_from_[station] = now;
}

/// One that another has overtaken is the answer to the request on the wire for anybody, where order
/// explains all that has come, and leaves no other request that it could be to. So is the one that
/// it has displaced, and that comes one late.
void Checker::on_reply(TimePoint now, ByteView adu, bool overtaken) {
    const std::uint8_t station = adu[0];
    said_[station].assign(adu.begin(), adu.end());
    if (adu[1] == modbus::kWriteSingleCoil || adu[1] == modbus::kWriteSingleRegister) {
        unlike_echo_.erase(station);
    } else {
        unlike_echo_.try_emplace(station, now);
    }
    const auto order = orders_.find(station);
    if (order == orders_.end()) return;
    const bool is_last =
        order->second.on_reply(now, adu.subspan(1, adu.size() - 3), latest_reply(station));
    if (overtaken) overtakers_.insert(station);
    if (overtakers_.contains(station) && is_last && attempt_.station == station)
        attempt_.imitated = true;
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
    if (what != FrameKind::retry) was_silent = watch_.is_silent(station);
    if (what == FrameKind::retry) {
        retried_.insert(station);
        watch_.on_again(now, station);
    } else {
        retried_.erase(station);
    }
    attempt_.was_silent = was_silent;
    attempt_.trusted = what == FrameKind::request && watch_.is_trusted(now, station);
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
    attempt_.first = false;
    attempt_.heard = false;
    attempt_.bytes = 0;
    attempt_.imitated = false;
    attempt_.span = test::read_span(station, pdu);
    attempt_.again = what == FrameKind::retry;
    const Bytes before = std::exchange(asked_[station], Bytes(pdu.begin(), pdu.end()));
    attempt_.same = std::ranges::equal(before, pdu) || are_confirmed_alike(before, pdu);
    const auto order = orders_.find(station);
    if (order != orders_.end()) order->second.on_asked(attempt_.sent, pdu);
    // Where an answer was not believed its own may still come, and the retry's fits both (P1).
    attempt_.owed = now < watch_.rests_until(station) ||
                    (what == FrameKind::retry && !watch_.is_failing(station));
    attempt_.needed = begun_after_[station];
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

/// Who has been silent, or is nobody's panel, is waited for as long as it has ever needed.
Duration Checker::least_wait() const {
    const std::uint8_t station = attempt_.station;
    if (!attempt_.trusted || adaptive_)
        return std::min<Duration>(watch_.own_slowest(station), 20ms);
    return settings_.unlisted.response_timeout;
}

void Checker::close_attempt(TimePoint now) {
    if (attempt_.answered) return;
    Missed& missed = missed_[attempt_.station];
    missed.only_overdue = missed.only_overdue && is_overdue(now, attempt_.station);
    const Duration cost = now - attempt_.started;
    const bool wanted = good_work_since(attempt_.started) == attempt_.started;
    const bool plain = calm_ && watch_.only_dies(attempt_.station) && !attempt_.heard;
    if (plain && attempt_.dead && cost > costs_.limit(attempt_) && wanted)
        fail("P4: an attempt at a silent station cost " + std::to_string(cost / 1ms) + " ms");
    const std::string broken = costs_.on_unanswered(now, attempt_, wanted);
    if (!broken.empty()) fail(broken);
    watch_.on_unanswered(now, attempt_.station, !attempt_.heard);
    watch_.on_owed(attempt_.station, owed_until());
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
    // An answer that repeats another one may be held back for as long as its station needs: it
    // could be a copy of that, with its own still to come (P1). Values are not handed on then, but
    // asked for once more. So may one that equals its request, for a timeout, where it could be
    // the echo (P8).
    const bool is_echo = may_have_echo() && may_be_echo(attempt_.station) && told_ < heard_until_;
    const Duration needs = is_echo ? settings_of(attempt_.station).response_timeout
                                   : watch_.own_slowest(attempt_.station);
    const TimePoint held = heard_until_ + needs + 20ms;
    const bool in_doubt = attempt_.answered && told_ <= attempt_.sent;
    const TimePoint over =
        std::max({sent_until_, heard_until_, is_echo || in_doubt ? held : std::min(told_, held)});
    const auto waited = good_work_since(over);
    if (!waited || now <= *waited + slack) return;
    const Duration idle = now - *waited;
    longest_idle_ = std::max(longest_idle_, idle);
    Duration most = slack;
    if (!attempt_.answered) most += settings_.unlisted.response_timeout;
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

/// For all that anybody can know, what was sent last may come back: it does, at times, or in part;
/// or its station has not answered before; or says its address and function in front of its
/// replies, like an adapter that hears the beginning of what it sends, until as many answers have
/// come as show that there is none.
bool Checker::may_have_echo() const {
    constexpr std::uint64_t kEnough = 16;
    const auto panel = std::ranges::find(plan_.panels, attempt_.station, &PanelPlan::id);
    const bool begins_twice = panel != plan_.panels.end() && panel->fragment > 0;
    return attempt_.first || echoes_ || (begins_twice && good_ < kEnough);
}

/// It says replies of other lengths than were asked for.
bool Checker::looks_late(std::uint8_t station) const {
    const auto panel = std::ranges::find(plan_.panels, station, &PanelPlan::id);
    return panel != plan_.panels.end() && panel->padded_inside > 0;
}

/// Since when, but not before `since`, a request has waited that nothing keeps from going: it has
/// not been sent, its station answers everything, and owes nothing (P1).
std::optional<TimePoint> Checker::good_work_since(TimePoint since) const {
    std::optional<TimePoint> first;
    for (const auto& [ticket, o] : open_) {
        const std::uint8_t station = o.job.station;
        const bool good = !o.sent && !o.gone && station != kBroadcast &&
                          !watch_.is_silent(station) && watch_.is_good(station, since) &&
                          !(o.write && echoes_);
        const TimePoint before = good ? behind_own(since, ticket, o) : TimePoint::max();
        if (before == TimePoint::max()) continue;
        const TimePoint from = std::max({since, o.submitted, before, rests_for(ticket, o)});
        if (!first || from < *first) first = from;
    }
    return first;
}

/// P8: until when a panel that answers broadcasts may say what would confirm this write: for as
/// long as it has ever needed, or, where it does so, as it may be late with anything.
TimePoint Checker::behind_broadcasts(const Open& open) const {
    const auto found = open.write ? spread_.find(modbus::normal_write_reply(open.job.request.pdu()))
                                  : spread_.end();
    if (found == spread_.end()) return {};
    const auto panel = std::ranges::find(plan_.panels, open.job.station, &PanelPlan::id);
    const bool answers = panel != plan_.panels.end() && panel->answers_broadcasts;
    const Duration timeout = settings_.unlisted.response_timeout;
    return found->second + (answers ? timeout + settings_.unlisted.late_window.value_or(8 * timeout)
                                    : 2 * watch_.own_slowest(open.job.station) + 50ms);
}

/// P1: until when the copy of its last reply may come. A copy may have been that of any equal reply
/// of the last half second, and may then be half as late again.
TimePoint Checker::behind_copies(std::uint8_t station) const {
    constexpr Duration kLatest = 500ms;
    const auto found = replied_.find(station);
    return found == replied_.end() || !doublers_.contains(station)
               ? TimePoint{}
               : found->second + kLatest * 3 / 2;
}

/// P1: until when the reply that was announced could be taken for that to this request, or to one
/// of its client that goes before it.
TimePoint Checker::behind_announced(arbiter::Ticket ticket, const Open& open) const {
    TimePoint over{};
    for (const auto& [older, o] : open_) {
        if (older > ticket) break;
        if (o.sent || o.gone || o.job.client != open.job.client ||
            o.job.station != open.job.station)
            continue;
        const auto found = announced_.find({o.job.station, form_of(o.job.request.pdu())});
        if (found != announced_.end()) over = std::max(over, found->second);
    }
    return over;
}

/// Until when its station is not asked for it, because of what that has said or may yet say.
TimePoint Checker::rests_for(arbiter::Ticket ticket, const Open& open) const {
    const auto damaged = behind_damage_.find(open.job.station);
    return std::max({watch_.rests_until(open.job.station), behind_broadcasts(open),
                     behind_announced(ticket, open), behind_copies(open.job.station),
                     damaged == behind_damage_.end() ? TimePoint{} : damaged->second});
}

/// Its client's broadcast goes before it, and behind a request to a station that is silent, or
/// rests: until when; max(): nobody knows.
TimePoint Checker::behind_own(TimePoint since, arbiter::Ticket ticket, const Open& open) const {
    const auto client = clients_.find(open.job.client);
    const bool held = client != clients_.end() && client->second.held_until > since;
    TimePoint rest = held ? TimePoint::max() : TimePoint{};
    TimePoint behind{};
    for (const auto& [older, o] : open_) {
        if (older >= ticket) break;
        if (o.gone || o.job.client != open.job.client) continue;
        if (!o.sent && o.job.station == kBroadcast) behind = rest;
        rest = watch_.is_silent(o.job.station) ? TimePoint::max()
                                               : std::max(rest, rests_for(older, o));
    }
    return behind;
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
    const auto before = silent_before_.find(station);
    const bool was_silent = before != silent_before_.end() && before->second;
    if (was_silent && watch_.only_dies(station) && calm_)
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
