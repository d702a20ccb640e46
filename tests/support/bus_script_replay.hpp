#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "support/bus_script.hpp"
#include "support/bus_step.hpp"

namespace panelgate::test {

/// What goes wrong before one step of a script, or in it.
enum class BusFault : std::uint8_t {
    line_lost,        ///< and back at once
    client_gone,      ///< the one that asked last
    byte_dropped,     ///< the first, a middle or the last one of what is heard
    deadlines_twice,  ///< each timer fires again
};
inline constexpr std::array<std::string_view, 4> kBusFaults{"line lost", "client gone",
                                                            "byte dropped", "deadlines twice"};

/// All was answered once, the arbiter is at rest and sends no more but probes.
inline void expect_rest(BusScript& bus) {
    bus.run_for(bus.settings().queue.deadline + 1s);
    std::size_t open = 0;
    TimePoint last{};
    for (const arbiter::Ticket ticket : bus.accepted) {
        if (!bus.answered(ticket)) ++open;
        if (bus.answered(ticket)) last = std::max(last, bus.answer(ticket).at);
    }
    EXPECT_EQ(open, 0u) << "never answered";
    EXPECT_EQ(bus.answers.size(), bus.accepted.size()) << "answers that nobody asked for";
    EXPECT_TRUE(bus.arbiter().idle());
    for (const BusScript::Sent& sent : bus.sent) {
        EXPECT_TRUE(sent.at <= last || sent.kind == FrameKind::probe)
            << "sent after all was answered: " << label(sent.kind) << " " << to_hex(sent.adu);
    }
    const auto next = bus.arbiter().next_deadline();
    EXPECT_TRUE(!next || *next > bus.now()) << "a deadline that has passed";
}

/// Plays the steps again, with the fault at step `at`; `which` byte is dropped.
inline void replay_with(const arbiter::Settings& settings, const std::vector<BusStep>& steps,
                        BusFault fault, std::size_t at, std::size_t which = 0) {
    SCOPED_TRACE(std::string(kBusFaults.at(static_cast<std::size_t>(fault))) + " at step " +
                 std::to_string(at) + ": " + to_code(steps[at]));
    BusScript bus(settings);
    arbiter::Client last = 1;
    for (std::size_t i = 0; i < steps.size(); ++i) {
        BusStep step = steps[i];
        if (step.verb == BusStep::Verb::submit) last = step.client;
        if (i == at && fault == BusFault::line_lost) bus.line_down();
        if (i == at && fault == BusFault::line_lost) bus.line_up();
        if (i == at && fault == BusFault::client_gone) bus.cancel(last);
        if (i == at && fault == BusFault::byte_dropped)
            step.bytes.erase(step.bytes.begin() + static_cast<std::ptrdiff_t>(which));
        bus.deadlines_twice = fault == BusFault::deadlines_twice && i >= at;
        bus.play(step);
    }
    expect_rest(bus);
}

/// Plays what was recorded again and again, each time with another fault at another step.
inline void replay_with_faults(const arbiter::Settings& settings,
                               const std::vector<BusStep>& steps) {
    for (std::size_t at = 0; at < steps.size(); ++at) {
        replay_with(settings, steps, BusFault::line_lost, at);
        replay_with(settings, steps, BusFault::client_gone, at);
        replay_with(settings, steps, BusFault::deadlines_twice, at);
        const std::size_t heard =
            steps[at].verb == BusStep::Verb::hear ? steps[at].bytes.size() : 0;
        for (std::size_t which = 0; which < heard; ++which)
            replay_with(settings, steps, BusFault::byte_dropped, at, which);
    }
}

}  // namespace panelgate::test
