#pragma once

#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "panelgate/arbiter/arbiter.hpp"
#include "panelgate/arbiter/settings.hpp"

namespace panelgate::scenario {

/// Registers from here on are memory that clients write; below, each holds how many requests its
/// station has served, plus something of its own: a value tells when it was read.
inline constexpr std::uint16_t kMemory = 1000;
inline constexpr std::uint16_t kMemoryCells = 16;
/// What register `address` of a station holds when it has served `served` requests.
std::uint16_t moving_value(std::uint8_t station, std::uint8_t function, std::uint16_t address,
                           std::uint64_t served);

/// Holds what an arbiter does against what it promises. Knows the truth (what the panels did and
/// when) from the world and the claims (answers, frames) from the arbiter; shares no code with it.
class Checker {
  public:
    explicit Checker(const arbiter::Settings& settings);

    // Claims
    void on_accepted(TimePoint now, arbiter::Ticket ticket, const arbiter::Job& job);
    void on_transmit(TimePoint now, const Bytes& adu, bool probe);
    void on_finish(TimePoint now, const arbiter::Finish& finish);
    /// How many waited before and after a request was handed in.
    void on_queue_depth(std::size_t before, std::size_t after);
    void on_line(TimePoint now);
    /// It asks for the same instant again and again.
    void on_spin() { fail("it spins: its deadline passes and nothing changes"); }
    // Truth
    void on_heard(TimePoint now);
    /// A good answer to the request on the wire was delivered to its last byte.
    void on_answered(TimePoint now);
    void on_served(TimePoint now, std::uint8_t station);
    void on_executed(TimePoint now, std::uint8_t station, ByteView pdu);
    void on_exception(TimePoint now, std::uint8_t station);
    /// `healthy`: none of the stations that it asks is ever dead, so that it must get answers.
    void on_client(arbiter::Client client, bool healthy);
    void on_client_gone(arbiter::Client client);
    /// Nothing more happens: everything must be answered.
    void at_end(TimePoint now, bool has_dead);

    bool failed() const { return !violation_.empty(); }
    /// The first one, "P1: …".
    const std::string& violation() const { return violation_; }
    std::uint64_t good_answers() const { return good_; }
    std::uint64_t frames() const { return frames_; }

  private:
    struct Open {
        arbiter::Job job;
        TimePoint submitted;
        std::uint64_t served = 0;  ///< by its station, when it was submitted
    };
    struct Cell {
        std::vector<std::pair<TimePoint, std::uint16_t>> values;
        TimePoint asked{};  ///< when a write to it last left
    };
    struct Station {
        std::uint64_t served = 0;
        std::deque<std::pair<TimePoint, std::uint64_t>> history;
        TimePoint last_exception{};
        std::map<std::uint16_t, Cell> cells;
    };
    struct Client {
        TimePoint own_write{};  ///< executed and confirmed: it must not read older
        std::uint64_t accepted = 0;
        std::uint64_t good = 0;
        bool healthy = false;
    };

    void fail(std::string what);
    void check_reply(TimePoint now, const Open& open, const arbiter::Finish& finish);
    void check_values(TimePoint now, const Open& open, const arbiter::Finish& finish);
    void check_moving(const Open& open, const Station& station, std::uint16_t address,
                      std::uint16_t value, std::optional<Duration> age, TimePoint now);
    void check_cell(const Open& open, const Station& station, std::uint16_t address,
                    std::uint16_t value, std::optional<Duration> age, TimePoint now);
    void check_write(TimePoint now, const Open& open, const arbiter::Finish& finish);
    Duration gap() const;

    arbiter::Settings settings_;
    bool adaptive_ = false;
    std::string violation_;
    std::map<arbiter::Ticket, Open> open_;
    arbiter::Ticket last_ticket_ = 0;
    std::map<std::uint8_t, Station> stations_;
    std::map<arbiter::Client, Client> clients_;
    std::map<std::string, TimePoint> executed_;  ///< station and PDU of every write
    std::set<std::string> written_;              ///< that were on the wire
    std::set<std::string> closed_writes_;        ///< answered: must not go on the wire any more
    std::map<std::string, arbiter::Ticket> open_writes_;
    TimePoint sent_until_{};
    TimePoint heard_until_{};
    bool answered_ = true;  ///< the request on the wire
    bool heard_something_ = false;
    TimePoint probe_started_{};
    bool probing_ = false;
    Duration probes_{};  ///< that nobody answered
    TimePoint started_{};
    std::uint64_t good_ = 0;
    std::uint64_t frames_ = 0;
};

}  // namespace panelgate::scenario
