#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <tuple>
#include <utility>

#include "panelgate/arbiter/job.hpp"
#include "panelgate/arbiter/read_cache.hpp"
#include "panelgate/arbiter/settings.hpp"
#include "panelgate/arbiter/waiting_reads.hpp"
#include "panelgate/base/inline_function.hpp"
#include "panelgate/base/pool.hpp"

namespace panelgate::arbiter {

/// The requests that wait for one line: whose turn it is, and who has to go when it is full (P9).
///
/// *Order.* What one client wants of one station is a lane and keeps its order. A client's
/// broadcast runs behind all that is older of it and before all that is younger.
/// *Turns.* The first jobs of the lanes compete: writes, then reads, then polls. Within a class
/// hosts take turns, within a host its clients, within a client its stations; each class has its
/// own rounds, or who writes much would never read. A read that may run gets at least every fifth
/// turn, a poll every tenth, whatever else waits; a write that is alone in its class starts within
/// two.
/// *Limits.* A read that another waiting read contains rides: it does not count. Whatever rides,
/// kMost wait at most (put_back aside).
/// *Full.* A newcomer takes the place of the newest request of the greediest client of the
/// greediest host, if these have more that counts than its own host, or else its own client, would
/// have: a poll, else a read; a write only for a write, or when its host holds more than half. A
/// write may also take the place of a poll or read of somebody who has as much as its own, but for
/// the last fifth of all places. What is taken away is the newest of its lane, but for reads behind
/// it that would not make room.
///
/// Pure, and a value. Tickets are unique and rise with each push. The tests that are handed in must
/// not call the queue.
class JobQueue {
  public:
    using Test = InlineFunction<bool(const Job&), 48>;
    static constexpr std::size_t kMost = 4096;
    static constexpr int kReadTurn = 5;   ///< a read gets at least every fifth turn
    static constexpr int kPollTurn = 10;  ///< a poll gets at least every tenth

    explicit JobQueue(const QueueSettings& settings) : settings_(settings) {}
    /// For whoever comes from now on: what waits stays.
    void apply(const QueueSettings& settings) { settings_ = settings; }

    /// What came of push(): taken or refused; taken at the cost of others, which are to be answered
    /// busy: one, or more where reads that others rode on count in their place.
    struct Admission {
        bool taken = false;
        Jobs shed;
    };
    Admission push(Job job);
    /// A job that was taken before: ahead of its client's younger ones for that station; never
    /// refused, never sheds.
    void put_back(Job job);

    /// The next in turn of those that may run, nullptr when none may. Valid until the next change.
    const Job* peek(const Test& may_run) const;
    /// Takes the one that peek() shows; the turns move on.
    std::optional<Job> pop(const Test& may_run);
    /// Takes, of all lanes for this station, the first jobs that match, again and again until none
    /// does. `wanted` may change its mind with each that it accepts. No turns move. Order of
    /// tickets.
    Jobs take_all(std::uint8_t station, const Test& wanted);
    /// In order of tickets.
    Jobs remove_if(const Test& match);
    /// Each lane's first job that order allows to run, until one matches. False when none does.
    bool any_first(const Test& match) const;

    /// Something of this client waits for this station; a broadcast of it is for every station.
    bool has(Client client, std::uint8_t station) const;
    /// The one popped last went ahead of a higher class that could have run: it was its turn.
    bool last_was_passed_over() const { return last_was_passed_over_; }
    /// Those that count against the limit; more than it only by what was put back, or when those
    /// that carried others went.
    std::size_t size() const { return size_; }
    std::size_t waiting() const { return expiries_.size(); }  ///< all
    bool empty() const { return expiries_.empty(); }
    /// The earliest start_by of all.
    std::optional<TimePoint> first_expiry() const;
    /// Counts everything again, for tests.
    bool consistent() const;

  private:
    static constexpr std::size_t kRanks = 3;  ///< probes are not queued
    /// Who is next, by turn.
    template <class Key>
    using Rounds = std::array<PoolMap<std::uint64_t, Key>, kRanks>;
    using Turns = std::array<std::uint64_t, kRanks>;
    using HostKey = std::pair<bool, std::uint64_t>;  ///< whether a client is its own, and its id

    struct Entry {
        Job job;
        std::optional<ReadSpan> span;  ///< of a read that can share
    };
    struct Lane {
        PoolDeque<Entry> jobs;
        Turns turns{};
    };
    struct Source {
        PoolMap<std::uint8_t, Lane> lanes;
        Rounds<std::uint8_t> rounds;
        Turns turns{};
        std::size_t counting = 0;
    };
    struct Origin {
        PoolMap<Client, Source> sources;
        Rounds<Client> rounds;
        Turns turns{};
        std::size_t counting = 0;
    };
    struct Place {
        HostKey host;
        Client client = 0;
        std::uint8_t station = 0;
    };
    struct Choice {
        std::array<std::optional<Place>, kRanks> first;  ///< of each class, that may run
        std::size_t rank = kRanks;                       ///< kRanks: none may
        bool passed_over = false;
    };
    /// The greatest goes first when somebody has to.
    struct Merit {
        bool is_write = false;
        bool makes_room = false;
        std::size_t rank = 0;
        Ticket ticket = 0;
        bool operator<(const Merit& other) const {
            return std::tuple(!is_write, makes_room, rank, ticket) <
                   std::tuple(!other.is_write, other.makes_room, other.rank, other.ticket);
        }
    };
    struct Victim {
        Place place;
        std::size_t index = 0;
        Merit merit;
    };
    struct Holder {
        const HostKey& host;
        const Origin& origin;
        Client client;
        const Source& source;
    };
    using Ask = InlineFunction<bool(const Holder&), 32>;

    static std::size_t rank_of(const Job& job);
    static bool in_order(const Source& source, std::uint8_t station);
    const Lane& lane_at(const Place& place) const;
    bool has_first(const Place& place) const;
    std::optional<Place> first_of(std::size_t rank, const Test& may_run) const;
    Choice choose(const Test& may_run) const;
    bool is_polls_turn(const Choice& choice, std::size_t top) const;
    void count_turn(const Choice& choice);
    void to_the_end(const Place& place, std::size_t rank);

    static Entry entry_of(Job job);
    HostKey host_of(const Job& job) const;
    Lane& open_lane(const Place& place);
    void insert(Entry entry);
    Job take(const Place& place, std::size_t index);
    void enlist(const Place& place);
    void delist(const Place& place);
    void close(const Place& place);  ///< a lane that has become empty
    void count(Client client, int by);
    void forget(const Entry& entry);

    std::size_t counting_of(Client client) const;
    bool make_room(const Job& newcomer, Jobs& shed);
    std::optional<Victim> find_victim(const Job& newcomer) const;
    std::optional<Victim> greediest(const Ask& may_lose, const Ask& writes_too) const;
    std::optional<Victim> victim_of(const Holder& holder, bool writes_too) const;
    std::optional<Victim> victim_in(const Holder& holder, std::uint8_t station) const;
    bool source_consistent(Client client, const HostKey& host, const Source& source) const;

    QueueSettings settings_;
    PoolMap<HostKey, Origin> hosts_;  ///< nothing empty in it
    Rounds<HostKey> rounds_;
    PoolMap<Client, HostKey> home_;  ///< of those that wait
    WaitingReads reads_;
    PoolMultiset<TimePoint> expiries_;  ///< of all that wait
    std::size_t size_ = 0;
    std::uint64_t turns_ = 0;
    /// Turns that others had while one of this class could have run.
    std::array<int, kRanks> passed_{};
    bool last_was_passed_over_ = false;
};

}  // namespace panelgate::arbiter
