#include "panel.hpp"

#include <algorithm>
#include <utility>

#include "panelgate/modbus/rtu_frame.hpp"
#include "speech.hpp"

namespace panelgate::scenario {

Panel::Panel(const PanelPlan& plan, const Plan& all, Agenda& agenda, Wire& wire, Random& random,
             Witness& witness)
    : plan_(plan),
      line_(all.settings),
      agenda_(agenda),
      wire_(wire),
      random_(random),
      witness_(witness),
      voice_(plan, line_, random) {}

void Panel::start() {
    if (plan_.reboots > Duration::zero())
        agenda_.at(agenda_.now() + random_.between(1s, plan_.reboots), [this] { reboot(); });
}

bool Panel::is_dead() const {
    if (plan_.dead || agenda_.now() < dark_until_) return true;
    if (plan_.flapping <= Duration::zero()) return false;
    return ((agenda_.now() - agenda_.started()) / plan_.flapping) % 2 == 1;
}

void Panel::reboot() {
    constexpr Duration kSilence = 8s;
    dark_until_ = agenda_.now() + kSilence;
    waiting_.clear();
    agenda_.at(dark_until_, [this] {
        Said text = voice_.text();
        text.connection = wire_.connection();
        wire_.say(std::move(text));
    });
    agenda_.at(agenda_.now() + kSilence + plan_.reboots, [this] { reboot(); });
}

bool Panel::takes(ByteView adu) {
    const TimePoint start = wire_.asked_since();
    const bool concerns = adu[0] == 0 || adu[0] == plan_.id;
    if (plan_.expects_replies > Duration::zero()) {
        const bool taken_for_reply = start < std::exchange(expects_until_, TimePoint{});
        if (taken_for_reply) return false;
        if (!concerns) expects_until_ = agenda_.now() + plan_.expects_replies;
    }
    return concerns && start >= replied_ + plan_.deaf_after;
}

void Panel::overhear() {
    if (agenda_.now() < expects_until_) expects_until_ = {};
}

void Panel::hear(ByteView adu, std::uint64_t connection) {
    constexpr std::size_t kRing = 4;
    const ByteView pdu = adu.subspan(1, adu.size() - 3);
    if (is_dead() || !modbus::crc_ok(adu, plan_.crc_order)) return;
    if (adu[0] == 0) {
        write(pdu);
        if (plan_.answers_broadcasts) answer_broadcast(pdu, connection);
        return;
    }
    if (random_.chance(plan_.drop)) return;
    if (pdu[0] > 4 && plan_.deaf_to_writes > 0 && random_.chance(plan_.deaf_to_writes)) return;
    if (plan_.overtakes) return begin({{pdu.begin(), pdu.end()}, agenda_.now(), connection});
    if (busy_ && (!plan_.ring || waiting_.size() >= kRing)) {
        // While it says what nobody expects behind its answer, that has hit the request.
        if (agenda_.now() >= answer_ends_) witness_.on_collision(agenda_.now(), plan_.id);
        return;
    }
    waiting_.push_back({{pdu.begin(), pdu.end()}, agenda_.now(), connection});
    if (!busy_) serve_next();
}

void Panel::answer_broadcast(ByteView pdu, std::uint64_t connection) {
    Said said;
    said.bytes = spoken(line_.serial, plan_.id, pdu.first(5), plan_.crc_order);
    said.rate = plan_.own_rate;
    said.connection = connection;
    const bool quick = plan_.broadcast_think == Duration::zero();
    const Duration after = quick ? random_.between(500us, Duration(8ms)) : plan_.broadcast_think;
    agenda_.at(agenda_.now() + after, [this, said = std::move(said)] { wire_.say(said); });
}

void Panel::serve_next() {
    busy_ = !waiting_.empty();
    if (!busy_) return;
    answer_ends_ = TimePoint::max();
    Request request = std::move(waiting_.front());
    waiting_.pop_front();
    const Duration silence = plan_.eager ? Duration{} : silent_interval(line_.serial);
    agenda_.at(std::max(agenda_.now(), request.arrived + silence),
               [this, request = std::move(request)] { begin(request); });
}

/// How much later than a request its answer may begin: see PanelPlan::late_limit.
Duration Panel::horizon() const {
    const double timeout = static_cast<double>(line_.unlisted.response_timeout.count());
    const Duration most(static_cast<Duration::rep>(timeout * plan_.late_limit));
    return plan_.nap > 0 ? std::max<Duration>(most, 2100ms) : most;
}

/// Such a read.
bool Panel::is_silent_to(unsigned registers) const {
    if (plan_.only_registers > 0 && registers != plan_.only_registers) return true;
    return plan_.refusal == 0 && registers > plan_.max_registers;
}

void Panel::begin(Request request) {
    const Duration thinking = think(request);
    const bool too_old = agenda_.now() + thinking > request.arrived + horizon();
    if (is_dead() || too_old) return serve_next();
    const bool silent = request.pdu[0] <= 4 && is_silent_to(word(request.pdu, 3));
    const Bytes reply = silent ? Bytes{} : serve(request.pdu);
    const bool mute = silent || random_.chance(plan_.mute);
    imitate(request, thinking);
    agenda_.at(agenda_.now() + thinking, [this, request = std::move(request), reply, mute] {
        if (mute || is_dead()) {
            serve_next();
        } else {
            answer(request, reply);
        }
    });
}

void Panel::imitate(const Request& request, Duration thinking) {
    constexpr unsigned kElsewhere = 500;
    constexpr unsigned kKnown = 24;  // replies, by which anybody may know its pace
    const bool moves = request.pdu[0] <= 4 && word(request.pdu, 1) < kElsewhere;
    if (plan_.imitates == Duration{} || !moves || served_ < kKnown ||
        agenda_.now() < imitated_ + plan_.imitates)
        return;
    Bytes elsewhere = request.pdu;
    elsewhere[1] = kElsewhere >> 8;
    const Bytes reply = plan_.imitates_last ? last_reply_ : read(elsewhere);
    if (reply.empty() || reply[0] != request.pdu[0]) return;
    imitated_ = agenda_.now();
    Said said;
    said.bytes = spoken(line_.serial, plan_.id, reply, plan_.crc_order);
    said.rate = plan_.own_rate;
    said.station = plan_.id;
    said.connection = request.connection;
    agenda_.at(agenda_.now() + thinking * 2 / 5, [this, said] { wire_.say(said); });
}

void Panel::answer(const Request& request, const Bytes& reply) {
    const Duration timeout = line_.unlisted.response_timeout;
    const Duration since = agenda_.now() - request.arrived;
    // What is late already says nothing but the reply.
    const Duration spare = timeout - since - silent_interval(line_.serial);
    last_reply_ = reply;
    std::vector<Utterance> all = voice_.speak(reply, spare);
    if (plan_.refuses_first > 0 && random_.chance(plan_.refuses_first)) refuse_first(request, all);
    if (plan_.repeats_request > 0 && random_.chance(plan_.repeats_request)) {
        Said said;
        said.bytes = spoken(line_.serial, plan_.id, request.pdu, plan_.crc_order);
        said.rate = plan_.own_rate;
        said.station = plan_.id;
        all.front().pause = silent_interval(line_.serial);
        all.insert(all.begin(), {Duration{}, std::move(said)});
    }
    say_all(std::move(all), 0, plan_.any_connection ? wire_.connection() : request.connection);
}

/// An exception that is none of 05 and 06, and that the reply follows all the same.
void Panel::refuse_first(const Request& request, std::vector<Utterance>& all) {
    constexpr unsigned kDeviceFailure = 4;
    Said said;
    said.bytes =
        spoken(line_.serial, plan_.id, refuse(request.pdu, kDeviceFailure), plan_.crc_order);
    said.rate = plan_.own_rate;
    said.station = plan_.id;
    said.answer_to = said.bytes.size();
    all.front().pause = 20ms;
    all.insert(all.begin(), {Duration{}, std::move(said)});
}

/// One piece after another; the last one is the gap.
void Panel::say_all(std::vector<Utterance> all, std::size_t next, std::uint64_t connection) {
    while (next < all.size()) {
        Utterance& piece = all[next];
        if (piece.pause > Duration::zero()) {
            const Duration pause = std::exchange(piece.pause, Duration{});
            agenda_.at(agenda_.now() + pause, [this, all = std::move(all), next, connection] {
                if (is_dead()) return serve_next();
                say_all(all, next, connection);
            });
            return;
        }
        ++next;
        if (piece.said.bytes.empty()) continue;
        piece.said.connection = connection;
        const bool is_answer = piece.said.answer_to > 0;
        const TimePoint end = wire_.say(std::move(piece.said));
        if (is_answer) answer_ends_ = replied_ = end;
        if (next == all.size())
            return agenda_.at(end + silent_interval(line_.serial), [this] { serve_next(); });
        agenda_.at(end, [this, all = std::move(all), next, connection] {
            say_all(all, next, connection);
        });
        return;
    }
    agenda_.at(agenda_.now() + silent_interval(line_.serial), [this] { serve_next(); });
}

Bytes Panel::refuse(ByteView pdu, unsigned code) {
    witness_.on_exception(agenda_.now(), plan_.id, pdu);
    return {static_cast<std::uint8_t>(pdu[0] | 0x80), static_cast<std::uint8_t>(code)};
}

Bytes Panel::serve(ByteView pdu) {
    if (random_.chance(plan_.wrong_function))
        return {static_cast<std::uint8_t>(0x84 ^ (pdu[0] & 4)), 2};
    if (random_.chance(plan_.exception)) return refuse(pdu, 6);
    if (pdu[0] > 4) return confirm(pdu);
    if (word(pdu, 3) > plan_.max_registers) return refuse(pdu, plan_.refusal);
    witness_.on_served(agenda_.now(), plan_.id);
    ++served_;
    return read(pdu);
}

Bytes Panel::confirm(ByteView pdu) {
    Bytes& last = confirmed_[pdu[0]];
    if (plan_.confirms_last > 0 && !last.empty() && random_.chance(plan_.confirms_last))
        return last;
    write(pdu);
    last.assign(pdu.begin(), pdu.begin() + 5);
    return last;
}

Bytes Panel::read(ByteView pdu) const {
    Writer out;
    if (pdu[0] <= 2) {
        const unsigned bytes = (word(pdu, 3) + 7u) / 8;
        out.u8(pdu[0]).u8(bytes).u8(coils_.contains(word(pdu, 1)) ? 1 : 0);
        for (unsigned i = 1; i < bytes; ++i) out.u8(0);
        return out.take();
    }
    out.u8(pdu[0]).u8(2u * word(pdu, 3));
    for (unsigned i = 0; i < word(pdu, 3); ++i) {
        const auto address = static_cast<std::uint16_t>(word(pdu, 1) + i);
        out.u16(address >= kMemory ? cells_.at(address - kMemory)
                                   : moving_value(plan_.id, pdu[0], address, served_));
    }
    return out.take();
}

void Panel::write(ByteView pdu) {
    witness_.on_executed(agenda_.now(), plan_.id, pdu);
    if (pdu[0] == 5 && pdu[3] != 0) coils_.insert(word(pdu, 1));
    if (pdu[0] == 5 && pdu[3] == 0) coils_.erase(word(pdu, 1));
    if (pdu[0] == 5) return;
    const unsigned count = pdu[0] == 16 ? word(pdu, 3) : 1;
    for (unsigned i = 0; i < count; ++i)
        cells_.at(word(pdu, 1) + i - kMemory) = word(pdu, pdu[0] == 16 ? 6 + 2 * i : 3);
}

Duration Panel::think(const Request& request) {
    const Duration waited = agenda_.now() - request.arrived;
    const auto at = [&](Duration after) { return std::max(after - waited, Duration{}); };
    if (random_.chance(plan_.nap)) return at(2s);
    if (random_.chance(plan_.late)) {
        const double timeout = static_cast<double>(line_.unlisted.response_timeout.count());
        const double timeouts = 0.5 + (plan_.late_limit - 0.5) * random_.share();
        return at(Duration(static_cast<Duration::rep>(timeout * timeouts)));
    }
    const bool slow = plan_.slow_think > Duration::zero() &&
                      ((agenda_.now() - agenda_.started()) / plan_.swing) % 2 == 1;
    return slow ? plan_.slow_think : plan_.think;
}

}  // namespace panelgate::scenario
