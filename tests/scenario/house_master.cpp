#include "house_master.hpp"

#include <string>
#include <utility>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/response.hpp"

namespace panelgate::scenario {
namespace {

/// A slave on the master's own wire: no panel behind the gateway has this address.
constexpr std::uint8_t kOther = 247;
const Bytes kReadOne{3, 0, 0, 0, 1};

bool fits(const modbus::RtuFrame& frame, const HouseJudge::Question& question) {
    return frame.station == question.station && modbus::answers(question.pdu, frame.pdu);
}

serial_server::Settings port_settings(const MasterPlan& plan, const std::string& line) {
    serial_server::Settings settings;
    settings.name = "plc";
    settings.device.serial = plan.port.settings.serial;
    settings.access.lines = {line};
    settings.access.framing = modbus::Framing::rtu;
    settings.access.broadcast = tcp_server::BroadcastMode::silent;
    settings.access.diagnostics_unit.reset();
    if (plan.on_failure_exception) settings.on_failure = serial_server::OnFailure::exception;
    if (plan.tells_timeout) settings.response_timeout = plan.timeout;
    return settings;
}

}  // namespace

HouseMaster::HouseMaster(const HousePlan& plan, const std::string& line, bus::BusClient& bus,
                         rt::Clock& clock, Agenda& agenda, Questions& questions, HouseJudge& judge,
                         Reach reach)
    : plan_(*plan.master),
      agenda_(agenda),
      questions_(questions),
      judge_(judge),
      random_(plan.line.seed ^ 0x5E41A1),
      wire_(plan_.port, agenda_, random_, nobody_),
      gateway_(make_gateway(plan, line, bus, clock, std::move(reach))),
      patient_(plan.line.line.pauses == 0 &&
               plan_.is_answered_within(plan.line.settings.queue.deadline)) {
    wire_.connect([this](ByteView bytes, bool) { line_->come(bytes); },
                  [this](ByteView adu, std::uint64_t) { hear(adu); });
}

serial_server::SerialMaster HouseMaster::make_gateway(const HousePlan& plan,
                                                      const std::string& line, bus::BusClient& bus,
                                                      rt::Clock& clock, Reach reach) {
    tcp_server::LineInfo info;
    info.name = line;
    info.bus = &bus;
    for (const arbiter::StationSettings& station : plan.line.settings.stations)
        units_.push_back(station.id);
    info.stations = units_;
    if (plan_.serves_others) info.stations.push_back(kOther);
    const serial_server::Settings settings = port_settings(plan_, line);
    auto port = std::make_unique<HouseLine>(agenda_, wire_, random_, plan.wake, std::move(reach));
    line_ = port.get();
    return {clock, settings, tcp_server::UnitMap(settings.access, {info}), std::move(port)};
}

void HouseMaster::start() {
    gateway_.start();
    go_on_at(agenda_.now() + plan_.pause, &HouseMaster::take_turn);
}

/// Unless something else comes before.
void HouseMaster::go_on_at(TimePoint when, void (HouseMaster::*how)()) {
    agenda_.at(when, [this, how, turn = ++turn_] {
        if (turn == turn_ && !ended_) (this->*how)();
    });
}

void HouseMaster::take_turn() {
    repeats_ = 0;
    if (random_.chance(plan_.others)) return ask_other();
    if (random_.chance(plan_.broadcasts)) return spread();
    const bool same = plan_.manner == Manner::mbpoll && asked_ && asked_->ours;
    const bool read = same && asked_->question.pdu[0] <= 4;
    if (read && random_.chance(0.9)) return ask(asked_->question.station, asked_->question.pdu);
    ask_anew();
}

void HouseMaster::ask_anew() {
    const std::uint8_t unit = units_[random_.below(static_cast<unsigned>(units_.size()))];
    ask(unit, random_.chance(plan_.writes) ? questions_.write() : questions_.read());
}

/// What it says once more before there was an answer is the same question.
void HouseMaster::ask(std::uint8_t unit, Bytes pdu) {
    if (pdu[0] > 4) judge_.allow_write(unit, pdu);
    const bool again = asked_ && asked_->ours && !asked_->answered &&
                       asked_->question.station == unit && asked_->question.pdu == pdu;
    if (!again) asked_ = Asked{judge_.ask(unit, pdu), true};
    asked_->damaged = false;
    const TimePoint end = say(modbus::encode_adu(unit, pdu));
    const bool hasty = random_.chance(plan_.talks_over);
    const Duration patience = hasty ? random_.between(0us, plan_.timeout) : plan_.timeout;
    go_on_at(end + patience, &HouseMaster::on_silence);
}

void HouseMaster::spread() {
    const Bytes pdu = questions_.write();
    judge_.allow_write(0, pdu);
    asked_ = Asked{judge_.ask(0, pdu)};
    const TimePoint end = say(modbus::encode_adu(0, pdu));
    const bool waits = plan_.manner != Manner::impatient;
    go_on_at(end + (waits ? Duration(100ms) : Duration(5ms)), &HouseMaster::take_turn);
}

void HouseMaster::ask_other() {
    asked_ = Asked{judge_.ask(kOther, kReadOne)};
    const TimePoint end = say(modbus::encode_adu(kOther, kReadOne));
    go_on_at(end + random_.between(2ms, Duration(20ms)), &HouseMaster::answer_as_other);
}

/// Its data may look like a request.
void HouseMaster::answer_as_other() {
    const Bytes inside = modbus::encode_adu(units_.front(), kReadOne);
    Writer pdu;
    pdu.u8(3).u8(static_cast<unsigned>(inside.size())).raw(inside);
    const TimePoint end = say(modbus::encode_adu(kOther, pdu.take()));
    go_on_at(end + plan_.pause, &HouseMaster::take_turn);
}

TimePoint HouseMaster::say(const Bytes& adu) {
    agenda_.tell("the serial master says", adu);
    Said said;
    said.bytes = adu;
    said.connection = wire_.connection();
    spoil(said);
    const TimePoint end = wire_.say(std::move(said));
    if (random_.chance(plan_.glitches))
        agenda_.at(end + random_.between(0us, Duration(2ms)), [this] { wire_.whisper({0}); });
    return end;
}

void HouseMaster::spoil(Said& said) {
    const auto size = static_cast<unsigned>(said.bytes.size());
    if (random_.chance(plan_.pieces)) {
        said.hole_before = random_.between(1, size - 1);
        // Behind one byte nobody knows that there will be more.
        said.hole = random_.between(1ms, Duration(said.hole_before == 1 ? 5ms : 50ms));
        return;
    }
    if (!random_.chance(plan_.damaged)) return;
    asked_->damaged = true;
    if (random_.chance(0.5)) {
        said.bytes[random_.below(size)] ^= static_cast<std::uint8_t>(1u << random_.below(8));
    } else {
        said.bytes.erase(said.bytes.begin() + static_cast<std::ptrdiff_t>(random_.below(size)));
    }
}

/// Nothing came in time, or it has no time.
void HouseMaster::on_silence() {
    constexpr unsigned kMost = 3;
    if (patient_) return judge_.fail("P3: a serial master was never answered");
    if (plan_.manner == Manner::impatient && repeats_ < kMost && random_.chance(0.5)) {
        ++repeats_;
        const HouseJudge::Question again = asked_->question;
        return ask(again.station, again.pdu);
    }
    go_on_at(agenda_.now() + plan_.pause, &HouseMaster::take_turn);
}

/// A frame of the gateway, undamaged.
void HouseMaster::hear(ByteView adu) {
    agenda_.tell("the serial master hears", adu);
    const auto frame = modbus::decode_adu(adu);
    const bool wanted = asked_ && asked_->ours && !asked_->damaged && !asked_->answered;
    if (!frame) return judge_.fail("P1: a serial master is told what is no frame");
    if (!wanted) return judge_.fail("P1: a serial master is told what it did not ask for");
    if (!fits(*frame, asked_->question))
        return judge_.fail("P1: a serial master is told what does not answer what it said last");
    asked_->answered = true;
    judge_reply(*frame);
    go_on_at(agenda_.now() + plan_.pause, &HouseMaster::take_turn);
}

void HouseMaster::judge_reply(const modbus::RtuFrame& frame) {
    const HouseJudge::Question& question = asked_->question;
    const Bytes pdu(frame.pdu.begin(), frame.pdu.end());
    if (modbus::exception_of(pdu)) {
        if (!plan_.on_failure_exception) judge_.judge_exception(question);
        return;
    }
    ++answered_;
    const auto max_age = judge_.max_age(question.station);
    judge_.judge(question, pdu, max_age ? std::optional(question.at - *max_age) : std::nullopt);
}

}  // namespace panelgate::scenario
