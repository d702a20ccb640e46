#include "house_seam.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"

namespace panelgate::scenario {

namespace {

/// Refusals are handed out a millisecond apart.
constexpr Duration kSlack = 2ms;

}  // namespace

void HouseJudge::on_executed(TimePoint now, std::uint8_t station, ByteView pdu) {
    truth_.on_executed(now, station, pdu);
    const std::string key = scenario::key_of(station, pdu);
    if (never_sent_.contains(key)) fail("P2: a write was executed that was answered as never sent");
    const auto found =
        std::ranges::find(plan_.line.settings.stations, station, &arbiter::StationSettings::id);
    if (found != plan_.line.settings.stations.end() && found->retry_writes) return;
    const auto allowed = allowed_.find(Bytes(pdu.begin(), pdu.end()));
    if (allowed != allowed_.end() && ++executed_[key] > allowed->second)
        fail("P2: a write was executed more often than it was asked for");
}

void HouseJudge::on_broadcast(ByteView pdu) {
    const Bytes all(pdu.begin(), pdu.end());
    if (++spread_[all] > allowed_[all])
        fail("P2: a broadcast went out more often than it was asked for");
}

std::optional<Duration> HouseJudge::max_age(std::uint8_t station) const {
    for (const arbiter::StationSettings& s : plan_.line.settings.stations) {
        if (s.id == station && s.max_age > Duration::zero()) return s.max_age;
    }
    return std::nullopt;
}

bool HouseJudge::in_time(TimePoint deadline) const {
    const TimePoint now = agenda_.now();
    if (now <= deadline + kSlack) return true;
    return std::ranges::any_of(pauses_, [&](const auto& pause) {
        return pause.first <= deadline + kSlack && now <= pause.second + kSlack;
    });
}

void HouseJudge::judge_exception(const Question& question) {
    if (!truth_.refused(question.station, question.pdu, question.at))
        fail("P1: an exception that the station did not send to this request");
}

void HouseJudge::judge(const Question& question, const Bytes& reply,
                       std::optional<TimePoint> oldest) {
    if (question.pdu[0] <= 4) return judge_read(question, reply, oldest);
    ++good;
    const auto done = truth_.executed(question.station, question.pdu);
    if (question.station != 0 && (!done || *done < question.at))
        fail("P2: a write is confirmed that was not executed");
}

void HouseJudge::judge_read(const Question& question, const Bytes& reply,
                            std::optional<TimePoint> oldest) {
    const std::size_t count = word(question.pdu, 3);
    if (reply[0] != question.pdu[0] || reply.size() != 2 + 2 * count)
        return fail("P1: a reply of another shape");
    Truth::Read read{question.station, question.pdu[0], agenda_.now(),
                     question.at,      question.served, std::nullopt};
    if (oldest) {
        read.since = *oldest;
        read.age = agenda_.now() - *oldest;
    }
    check(read, word(question.pdu, 1), ByteView(reply).subspan(2));
    ++good;
}

/// P1, P6. One in 65536 of what two speakers make of each other's frames passes the CRC: of what
/// nobody has said that is forgiven, as long as it is that seldom.
void HouseJudge::check(const Truth::Read& read, std::uint16_t first, ByteView values) {
    constexpr std::uint64_t kSeldom = 10000;
    for (std::size_t i = 0; 2 * i < values.size(); ++i) {
        const auto address = static_cast<std::uint16_t>(first + i);
        const char* wrong = truth_.fault_of(read, address, word(values, 2 * i));
        if (wrong == nullptr) continue;
        if (garbled_ == 0 || !truth_.is_chance(values)) return fail(wrong);
        lucky_.insert({values.begin(), values.end()});
        if (lucky_.size() > 1 + garbled_ / kSeldom) fail(wrong);
        return;
    }
}

void HouseJudge::judge_values(std::uint8_t station, std::uint16_t address,
                              const std::vector<std::uint16_t>& values, TimePoint sampled) {
    const TimePoint now = agenda_.now();
    const Truth::Read read{station, 3, now, sampled, 0, now - sampled};
    Writer bytes;
    for (const std::uint16_t value : values) bytes.u16(value);
    check(read, address, bytes.take());
}

void HouseSeam::transact(bus::Request request, bus::AnswerHandler handler) {
    Open open{judge_.ask(request.station, request.request.pdu()), request.client, request.poll,
              polls_};
    if (open.poll) judge_relay(open);
    judge_master(open);
    const std::uint64_t id = ++last_;
    open_[id] = open;
    ask_twice(request);
    if (flaw_ == Flaw::polls_first && open.poll) request.poll = false;
    if (flaw_ == Flaw::answers_at_once && id % 50 == 0) {
        inside_ = true;
        hand_over(open, {}, handler, id);
        inside_ = false;
        return;
    }
    inside_ = true;
    const auto asked = std::make_shared<std::pair<Open, bus::AnswerHandler>>(open, handler);
    bus_.transact(std::move(request), [this, id, asked](bus::Answer answer) {
        hand_over(asked->first, std::move(answer), asked->second, id);
    });
    inside_ = false;
}

/// What a relay writes it has read just before.
void HouseSeam::judge_relay(const Open& open) {
    const Bytes& pdu = open.question.pdu;
    if (pdu[0] == 3 && word(pdu, 1) == kRelayFrom) relay_asked_ = agenda_.now();
    if (pdu[0] != 16) return;
    ++relayed_;
    const std::vector<std::uint16_t> values{word(pdu, 6), word(pdu, 8)};
    judge_.judge_values(plan_.line.panels.front().id, kRelayFrom, values, relay_asked_);
}

void HouseSeam::hand_over(const Open& open, bus::Answer answer, const bus::AnswerHandler& handler,
                          std::uint64_t id) {
    const bool read = open.question.pdu[0] <= 4 && answer.pdu.has_value();
    if (flaw_ == Flaw::answers_never && id % 50 == 0) return;
    if (flaw_ == Flaw::answers_the_other && read && id % 20 == 0 && last_read_) {
        answer = *std::exchange(last_read_, std::nullopt);
    } else if (read) {
        last_read_ = answer;
    }
    if (flaw_ == Flaw::remembers && read && !open.poll) {
        const std::string key = key_of(open.question.station, open.question.pdu);
        answer = remembered_.try_emplace(key, answer).first->second;
    }
    if (is_masters(open) && flaw_ == Flaw::silent_to_masters && id % 20 == 0)
        return on_answer(id, answer);
    if (is_masters(open) && flaw_ == Flaw::answers_the_next) {
        const bool given_up = open_.at(id).withdrawn;
        on_answer(id, answer);
        if (spoils_master(open, given_up, answer)) handler(std::move(answer));
        return;
    }
    const int times = flaw_ == Flaw::answers_twice && id % 50 == 0 ? 2 : 1;
    for (int i = 0; i < times; ++i) {
        on_answer(id, answer);
        handler(answer);
    }
}

void HouseSeam::name_client(bus::ClientId client, std::string name) {
    if (name.starts_with("serial ")) masters_.insert(client);
    bus_.name_client(client, std::move(name));
}

void HouseSeam::cancel(bus::ClientId client) {
    if (flaw_ == Flaw::keeps_withdrawn && masters_.contains(client)) return;
    for (auto& [id, open] : open_) open.withdrawn = open.withdrawn || open.client == client;
    bus_.cancel(client);
}

/// Who is alone on its line has one request open at most: what it says next gives up the one
/// before.
void HouseSeam::judge_master(const Open& open) {
    if (!is_masters(open)) return;
    const bool second = std::ranges::any_of(open_, [&](const auto& entry) {
        const Open& other = entry.second;
        return other.client == open.client && other.question.station != 0 && !other.withdrawn;
    });
    if (second) judge_.fail("two requests of a serial master are open at once");
}

/// Broken on purpose: the reply to what was given up is told as that to what is asked now. False:
/// this answer is kept for it.
bool HouseSeam::spoils_master(const Open& open, bool given_up, bus::Answer& answer) {
    if (open.question.pdu[0] > 4 || !answer.pdu) return true;
    if (given_up) {
        given_up_ = std::move(answer);
        return false;
    }
    if (given_up_) answer = *std::exchange(given_up_, std::nullopt);
    return true;
}

void HouseSeam::ask_twice(const bus::Request& request) {
    const bool spreads = flaw_ == Flaw::spreads_twice && request.station == 0;
    const bool writes =
        flaw_ == Flaw::writes_twice && request.station != 0 && !request.request.is_read();
    if (masters_.contains(request.client) && (spreads || writes))
        bus_.transact(request, [](const bus::Answer&) {});
}

void HouseSeam::on_answer(std::uint64_t id, const bus::Answer& answer) {
    if (inside_) judge_.fail("answered from inside transact()");
    const auto found = open_.find(id);
    if (found == open_.end()) return judge_.fail("a request was answered twice");
    const Open open = std::move(found->second);
    open_.erase(found);
    ++answers_;
    judge(open, answer);
    if (open.poll && answer.transmitted && !answer.shared) ++polls_;
}

void HouseSeam::judge(const Open& open, const bus::Answer& answer) {
    const bool cached = answer.source == bus::Source::cache;
    if (!judge_.in_time(open.question.at + plan_.line.settings.queue.deadline))
        judge_.fail("P3: answered after its deadline");
    if (cached && open.poll) judge_.fail("P6: a poll was answered by the memory");
    if (cached && answer.age > judge_.max_age(open.question.station).value_or(Duration::zero()))
        judge_.fail("P6: a value older than max_age");
    if (!answer.pdu) {
        if (!answer.transmitted && open.question.pdu[0] > 4) judge_.on_never_sent(open.question);
        // A poll may find no turn: the client has one whenever it wants it.
        if (plan_.calm && !open.poll && answer.pdu.error() != Fault::cancelled)
            judge_.fail("P4: a sound panel's request failed: " +
                        std::string(label(answer.pdu.error())));
        return;
    }
    if (modbus::exception_of(*answer.pdu)) return judge_.judge_exception(open.question);
    judge_.judge(open.question, *answer.pdu,
                 cached ? std::optional(agenda_.now() - answer.age) : std::nullopt);
    if (plan_.calm && !open.poll && polls_ - open.polls > 2)
        judge_.fail("P9: polls went before a client's request");
}

}  // namespace panelgate::scenario
