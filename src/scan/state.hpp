#pragma once

#include <bitset>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "attempt.hpp"
#include "panelgate/modbus/ascii.hpp"
#include "panelgate/scan/result.hpp"
#include "panelgate/scan/scanner.hpp"
#include "plan.hpp"
#include "recogniser.hpp"

namespace panelgate::scan {

/// A frame of somebody else's conversation.
void note(Talk& talk, const Frame& frame);

struct Scanner::State {
    enum class Phase : std::uint8_t { listening, searching, asking, done };
    /// Why the request on the wire was sent.
    enum class Purpose : std::uint8_t {
        search,
        first_pass,
        second_pass,
        high_first_pass,
        again,
        examine,
    };
    struct Again {
        std::uint8_t station = 0;
        unsigned tries = 0;
        bool late = false;
        bool begun = false;  ///< of its damaged replies, one surely was a reply
    };

    State(const profile::Catalogue& catalogue, Settings s, TimePoint now);

    void step(TimePoint now);
    TimePoint due() const;

    // listening.cpp
    void listen(TimePoint now, Duration how_long);
    void end_listening(TimePoint now);

    // scanner.cpp
    void set_format(TimePoint now, const SerialFormat& wanted);
    void start_next(TimePoint now);
    void start_search(TimePoint now);
    void start_asking(TimePoint now);
    void ask(TimePoint now, std::uint8_t station, Duration timeout, Purpose why);
    void transmit(TimePoint now, const Ask& wanted, Purpose why);
    void finish_attempt();
    void on_outcome(std::uint8_t station, const Outcome& outcome);
    void ask_again_later(std::uint8_t station);
    void try_high_first(std::uint8_t station);
    void on_damaged(std::uint8_t station, bool begun);
    void on_stray(const Frame& frame);
    void settle();
    void found(std::uint8_t station);
    std::optional<SerialFormat> known_format() const;
    /// May have the CRC's high byte first, as far as is known of the format.
    bool may_be_old(std::uint8_t station) const;
    /// What is heard in this format, as RTU says it.
    void take_in(TimePoint now, ByteView bytes);
    Duration asking_cost() const;
    std::string activity() const;

    const profile::Catalogue& profiles;
    Settings settings;
    std::vector<SerialFormat> formats;
    std::vector<std::uint8_t> stations;
    SearchPlan plan;
    TimePoint started;
    Duration latency{};
    std::deque<Action> actions;  ///< at most a SetFormat and a Transmit

    Phase phase = Phase::listening;
    SerialFormat format;  ///< of the line, now
    TimePoint not_before;
    /// Of what is heard since the format was set, or a request was sent.
    modbus::AsciiTranscript transcript{modbus::HexDigits::any_case};

    std::size_t listening_at = 0;  ///< index of formats
    bool listened_again = false;
    Bytes heard;

    std::optional<Cell> cell;  ///< to be asked when its format is set
    std::unique_ptr<Attempt> attempt;
    Purpose purpose = Purpose::search;
    std::optional<Again> retry;  ///< what `attempt` is, when its purpose is `again`

    std::bitset<256> asked;       ///< in this format
    std::bitset<256> waited_for;  ///< were or are in second_pass
    std::set<std::uint8_t> answered;
    std::map<std::uint8_t, Evidence> beforehand;  ///< seen outside of the examination
    std::deque<Again> again;
    std::deque<std::uint8_t> first_pass;
    std::deque<std::uint8_t> second_pass;
    std::deque<std::uint8_t> high_first_pass;  ///< silent otherwise, and a profile says how
    modbus::CrcOrders orders;                  ///< in which each station is asked next
    std::deque<std::uint8_t> to_examine;
    std::unique_ptr<Examination> examination;
    Result result;
};

/// Decides, with all stations known, which addresses two stations share and whether the line is
/// noisy instead: damage at one address among good ones is a collision, damage everywhere is not.
void tell_duplicates(Result& result);

}  // namespace panelgate::scan
