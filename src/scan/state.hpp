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
#include "panelgate/scan/report.hpp"
#include "panelgate/scan/scanner.hpp"
#include "recogniser.hpp"

namespace panelgate::scan {

/// Adds a frame between another master and its stations.
void add_frame(Talk& talk, const Frame& frame);

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
        bool header_seen = false;  ///< one of the damaged replies contained address and function
    };

    State(const profile::Catalogue& catalogue, Settings s, TimePoint now);

    void step(TimePoint now);
    TimePoint due() const;

    // state.cpp
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
    void queue_second_pass(std::uint8_t station);
    void queue_high_first(std::uint8_t station);
    void on_damaged(std::uint8_t station, bool header_seen);
    void on_unsolicited(const Frame& frame);
    void accept_format();
    void found(std::uint8_t station);
    std::optional<SerialFormat> known_format() const;
    /// True if the station may use the CRC's high byte first, given what is known of the format.
    bool station_may_be_high_first(std::uint8_t station) const;
    /// Processes bytes received in this format, converted to RTU.
    void receive(TimePoint now, ByteView bytes);
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
    SerialFormat format;  ///< the line's current format
    TimePoint not_before;
    /// Bytes heard since the format was set, or a request was sent.
    modbus::AsciiTranscript transcript{modbus::HexDigits::any_case};

    std::size_t listening_at = 0;  ///< index into formats
    bool listened_again = false;
    Bytes heard;

    std::optional<Cell> cell;  ///< to be asked once its format is set
    std::unique_ptr<Attempt> attempt;
    Purpose purpose = Purpose::search;
    std::optional<Again> retry;  ///< details of `attempt`, if its purpose is `again`

    std::bitset<256> asked;       ///< in this format
    std::bitset<256> waited_for;  ///< stations that are or were in second_pass
    std::set<std::uint8_t> answered;
    std::map<std::uint8_t, Evidence> other_evidence;  ///< seen outside of the examination
    std::deque<Again> again;
    std::deque<std::uint8_t> first_pass;
    std::deque<std::uint8_t> second_pass;
    std::deque<std::uint8_t> high_first_pass;  ///< silent so far, and a profile uses this order
    modbus::CrcOrders orders;                  ///< for the next request of each station
    std::deque<std::uint8_t> to_examine;
    std::unique_ptr<Examination> examination;
    Result result;
};

/// Call when all stations are known: marks addresses shared by two stations, or the line as noisy.
/// Damage at one address among good ones is a collision, damage everywhere is noise.
void mark_duplicates(Result& result);

}  // namespace panelgate::scan
