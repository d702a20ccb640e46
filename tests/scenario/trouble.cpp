#include "trouble.hpp"

#include <utility>

#include "speech.hpp"

namespace panelgate::scenario {
namespace {

/// Of the other master; none of ours is above 160, not even with a wrong address.
constexpr std::uint8_t kForeignPanel = 201;

}  // namespace

void Trouble::start() {
    const LinePlan& line = plan_.line;
    if (line.idle_noise > 0) agenda_.at(agenda_.now() + 1s, [this] { make_noise(); });
    if (line.floating > 0) agenda_.at(agenda_.now() + 3s, [this] { begin_to_float(); });
    if (line.babble > Duration::zero()) agenda_.at(agenda_.now() + 1s, [this] { babble(); });
    if (line.other_master) agenda_.at(agenda_.now() + 1s, [this] { listen(); });
}

void Trouble::make_noise() {
    if (is_over_()) return;
    Said noise;
    for (unsigned i = random_.between(1, 6); i > 0; --i)
        noise.bytes.push_back(static_cast<std::uint8_t>(random_.next()));
    noise.connection = wire_.connection();
    wire_.say(std::move(noise));
    agenda_.at(agenda_.now() + random_.between(100ms, Duration(10s)), [this] { make_noise(); });
}

/// A pair that nobody drives: the receiver sees bytes in each silence. Whoever speaks drives it.
void Trouble::begin_to_float() {
    if (is_over_()) return;
    hum(agenda_.now() + random_.between(1s, Duration(4s)));
    const auto mean = std::chrono::duration<double>(1 / plan_.line.floating);
    agenda_.at(
        agenda_.now() + 4s + random_.between(0us, std::chrono::duration_cast<Duration>(2 * mean)),
        [this] { begin_to_float(); });
}

void Trouble::hum(TimePoint until) {
    auto byte = static_cast<std::uint8_t>(random_.chance(0.5) ? 0 : random_.next());
    // A line feed ends an ASCII frame, for any master (SL 2.5.2).
    if (plan_.settings.serial.mode == SerialMode::ascii && byte == '\n') byte = 0;
    wire_.whisper({byte});
    if (agenda_.now() < until && !is_over_())
        agenda_.at(agenda_.now() + 1500us, [this, until] { hum(until); });
}

/// A panel that says good frames on its own. Of a function that nobody here asks for: one that has
/// the shape of the answer that is awaited, in its moment, is the answer for any gateway.
void Trouble::babble() {
    if (is_over_()) return;
    Said said;
    const std::uint8_t id = plan_.panels.back().id;
    const auto inputs = static_cast<std::uint8_t>(random_.between(1, 8));
    Bytes pdu{2, inputs};
    pdu.resize(2u + inputs, 0x55);
    said.bytes = spoken(plan_.settings.serial, id, pdu, plan_.panels.back().crc_order);
    said.connection = wire_.connection();
    wire_.say(std::move(said));
    agenda_.at(agenda_.now() + plan_.line.babble, [this] { babble(); });
}

Bytes Trouble::foreign_read() const { return {3, 0, 0, 0, 2}; }

/// Polite: it waits for 10 to 30 ms of silence.
void Trouble::listen() {
    if (is_over_()) return;
    const Duration patience = random_.between(10ms, Duration(30ms));
    if (agenda_.now() >= next_question_ && wire_.is_quiet_for(patience)) return ask_own_panel();
    agenda_.at(agenda_.now() + random_.between(1ms, Duration(8ms)), [this] { listen(); });
}

void Trouble::ask_own_panel() {
    Said question;
    question.bytes = spoken(plan_.settings.serial, kForeignPanel, foreign_read());
    question.connection = wire_.connection();
    const TimePoint end = wire_.say(std::move(question));
    const TimePoint reply =
        end + silent_interval(plan_.settings.serial) + random_.between(2ms, Duration(20ms));
    agenda_.at(reply, [this] {
        Said answer;
        answer.bytes = spoken(plan_.settings.serial, kForeignPanel, Bytes{3, 4, 0, 1, 0, 2});
        answer.connection = wire_.connection();
        const TimePoint done = wire_.say(std::move(answer));
        next_question_ = done + random_.between(20ms, Duration(400ms));
        agenda_.at(done, [this] { listen(); });
    });
}

}  // namespace panelgate::scenario
