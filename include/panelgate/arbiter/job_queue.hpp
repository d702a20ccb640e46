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
#include "panelgate/base/inline_function.hpp"
#include "panelgate/base/pool.hpp"

namespace panelgate::arbiter {

/// The requests that wait for one line: which is next, and which is dropped when it is full (P9).
///
/// *Order.* One client's requests to one station form a lane and keep their order. A client's
/// broadcast runs after all its older requests and before all its younger ones.
/// *Turns.* The first jobs of the lanes compete: writes, then reads, then polls. Within a class
/// hosts take turns, within a host its clients, within a client its stations; each class has its
/// own rounds, so that a client with many writes still gets to read. A runnable read gets at least
/// every fifth turn, a poll every tenth, whatever else waits; a write that is alone in its class
/// starts within two.
/// *Limits.* A read that another waiting read contains is carried by that and does not count.
/// Including carried reads, kMost wait at most (put_back aside).
/// *Full.* A newcomer replaces the newest request of the client with the most counted requests, of
/// the host with the most, if these have more than its own host, or else its own client, would then
/// have: a poll, else a read; a write only for a write, or if its host holds more than half. A
/// write may also replace a poll or read of a client with as many requests as its own, except in
/// the last fifth of all places. The newest of a lane is dropped, except reads behind it that would
/// not free a place.
///
/// Pure, and a value. Tickets are unique and rise with each push. The test functions passed in must
/// not call the queue.
class JobQueue {
  public:
    using Test = InlineFunction<bool(const Job&), 48>;
    static constexpr std::size_t kMost = 4096;
    static constexpr int kReadTurn = 5;   ///< a read gets at least every fifth turn
    static constexpr int kPollTurn = 10;  ///< a poll gets at least every tenth

    explicit JobQueue(const QueueSettings& settings) : settings_(settings) {}
    /// Applies to new jobs; queued ones stay.
    void apply(const QueueSettings& settings) { settings_ = settings; }

    /// Result of push(): taken or refused. `shed` holds the jobs dropped for it, which must be
    /// answered busy: one, or more if carried reads count in its place.
    struct PushResult {
        bool taken = false;
        Jobs shed;
    };
    PushResult push(Job job);
    /// Returns a job that was taken before: ahead of its client's younger ones for that station;
    /// never refused, never drops others.
    void put_back(Job job);

    class Choice;
    /// The next in turn of the runnable jobs, if there is one. Valid until the next change.
    Choice choose(const Test& may_run) const;
    /// Takes the job that was chosen and advances the turns. There must be one.
    Job take(const Choice& choice);
    const Job* peek(const Test& may_run) const;
    std::optional<Job> pop(const Test& may_run);
    /// Takes the matching first jobs of all lanes for this station, repeatedly until none matches;
    /// `wanted` may depend on what it accepted. Turns do not advance. In order of tickets.
    Jobs take_all(std::uint8_t station, const Test& wanted);
    /// Removes and returns the matching jobs, in order of tickets.
    Jobs remove_if(const Test& match);
    /// Visits each lane's first job that order allows to run, until one matches. False if none
    /// does.
    bool any_first(const Test& match) const;

    /// True if a job of this client waits for this station; a broadcast is for every station.
    bool has(Client client, std::uint8_t station) const;
    /// True if the job popped last went ahead of a runnable higher class: it was its turn.
    bool last_was_passed_over() const { return last_was_passed_over_; }
    /// Jobs that count against the limit; above it only after put_back(), or when reads that
    /// carried others were taken.
    std::size_t size() const { return size_; }
    std::size_t waiting() const { return expiries_.size(); }  ///< all of them
    bool empty() const { return expiries_.empty(); }
    /// The earliest start_by of all.
    std::optional<TimePoint> first_expiry() const;
    /// Recounts everything. For tests.
    bool consistent() const;

  private:
    static constexpr std::size_t kRanks = 3;  ///< probes are not queued
    /// Keys in order of their turns.
    template <class Key>
    using Rounds = std::array<PoolMap<std::uint64_t, Key>, kRanks>;
    using Turns = std::array<std::uint64_t, kRanks>;
    using HostKey =
        std::pair<bool, std::uint64_t>;  ///< whether it is a client without a host, and the id

    struct Entry {
        Job job;
        std::optional<ReadSpan> span;  ///< of a shareable read
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
    /// Drop order: the greatest is dropped first.
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
    bool is_polls_turn(const Choice& choice, std::size_t top) const;
    void count_turn(const Choice& choice);
    void move_to_back(const Place& place, std::size_t rank);

    static Entry entry_of(Job job);
    HostKey host_of(const Job& job) const;
    Lane& open_lane(const Place& place);
    void insert(Entry entry);
    Job take(const Place& place, std::size_t index);
    void enlist(const Place& place);
    void delist(const Place& place);
    void close(const Place& place);  ///< removes an empty lane
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
    PoolMap<HostKey, Origin> hosts_;  ///< no empty entries
    Rounds<HostKey> rounds_;
    PoolMap<Client, HostKey> home_;  ///< of clients with waiting jobs
    WaitingReads reads_;
    PoolMultiset<TimePoint> expiries_;  ///< of all waiting jobs
    std::size_t size_ = 0;
    std::uint64_t turns_ = 0;
    /// Turns of other classes while one of this class was runnable.
    std::array<int, kRanks> passed_{};
    bool last_was_passed_over_ = false;
};

class JobQueue::Choice {
  public:
    /// Null: none is runnable.
    const Job* job() const { return job_; }

  private:
    friend class JobQueue;
    const Job* job_ = nullptr;
    std::array<std::optional<Place>, kRanks> first_;  ///< first runnable one of each class
    std::size_t rank_ = kRanks;
    bool passed_over_ = false;
};

}  // namespace panelgate::arbiter
