#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <tuple>
#include <utility>

#include "panelgate/arbiter/queue/job.hpp"
#include "panelgate/arbiter/queue/read_cache.hpp"
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
    using Test = InlineFunction<bool(const Job&), 64>;
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
    /// A refused job stays as it was; a taken job is moved from.
    PushResult push(Job& job);
    PushResult push(Job&& job) { return push(job); }
    /// Puts a taken job back, ahead of the client's younger jobs for that station. Never refused.
    void put_back(Job&& job);

    class Choice;
    /// The next in turn of the runnable jobs, if there is one. Valid until the next change.
    Choice choose(const Test& may_run) const;
    /// Takes the job that was chosen and advances the turns. There must be one.
    Job take(const Choice& choice);
    /// Takes the matching first jobs of all lanes for this station that are reads to be shared,
    /// until none matches; `wanted` may depend on what it accepted. Turns do not advance.
    Jobs take_reads(std::uint8_t station, const Test& wanted);
    /// Removes and returns the matching jobs, in order of tickets.
    Jobs remove_if(const Test& match);
    /// Visits each lane's first job that order allows, until one matches. False if none does.
    bool any_first(const Test& match) const;

    /// True if a job of this client waits for this station; a broadcast is for every station.
    bool has(Client client, std::uint8_t station) const;
    /// True if the job popped last went ahead of a runnable higher class: it was its turn.
    bool last_was_passed_over() const { return last_was_passed_over_; }
    /// Jobs that count; above the limit after put_back(), or when reads that carried were taken.
    std::size_t size() const { return size_; }
    std::size_t waiting() const { return expiries_.size(); }  ///< all of them
    bool empty() const { return expiries_.empty(); }
    /// The earliest start_by of all.
    std::optional<TimePoint> first_expiry() const;

  private:
    static constexpr std::size_t kRanks = 3;  ///< probes are not queued
    /// Of each class: when the last turn was, or when it came. The least is next; none are equal.
    using Turns = std::array<std::uint64_t, kRanks>;
    using HostKey =
        std::pair<bool, std::uint64_t>;  ///< whether it is a client without a host, and the id

    struct Entry {
        Job job;
        std::optional<ReadSpan> span;
    };
    struct Lane {
        PoolDeque<Entry> jobs;  ///< in order of tickets
        Turns turns{};
    };
    /// What one client has waiting.
    struct Source {
        HostKey host;
        PoolMap<std::uint8_t, Lane> lanes;
        Turns turns{};
        std::size_t counting = 0;

        /// The first job of this lane where order allows the job to run, else null.
        const Entry* first(std::uint8_t station) const;
    };
    /// What one host has waiting.
    struct Origin {
        PoolSet<Client> clients;
        Turns turns{};
        std::size_t counting = 0;
        std::array<std::size_t, kRanks> firsts{};  ///< lanes whose first job is of the class
    };
    struct Place {
        Client client = 0;
        std::uint8_t station = 0;
    };
    /// A lane, and whose it is.
    struct Found {
        Place place;
        const Source& source;
        const Lane& lane;
    };
    /// A job that may be dropped: the greatest is.
    struct Victim {
        /// Greed beside the newcomer, then the requests that the host and the client have waiting.
        std::tuple<int, std::size_t, std::size_t> greed;
        bool is_no_write = false;  ///< a write goes last
        bool makes_room = false;
        std::size_t rank = 0;
        Ticket ticket = 0;
        Place place;
        std::size_t index = 0;

        auto merit() const { return std::tie(greed, is_no_write, makes_room, rank, ticket); }
    };

    static std::size_t rank_of(const Job& job);
    /// Visits all lanes, until one visit returns true.
    template <class Visit>
    bool any_lane(const Visit& visit) const;
    const Source* find(Client client) const;
    std::pair<const Job*, Place> first_of(std::size_t rank, const Test& may_run) const;
    bool is_polls_turn(const Choice& choice, std::size_t top) const;
    void count_turn(const Choice& choice);

    static std::optional<ReadSpan> span_of(const Job& job);  ///< of a shareable read
    HostKey host_of(const Job& job) const;
    std::pair<Source&, Lane&> open_lane(const Job& job);
    void count_first(const HostKey& host, const Job& job, int by);
    Job take(const Place& place, std::size_t index = 0);
    void count(const Entry& entry, int by);

    bool make_room(const Job& newcomer, Jobs& shed);
    std::optional<Victim> find_victim(const Job& newcomer) const;
    std::optional<Victim> victim_in(const Found& found) const;

    QueueSettings settings_;
    PoolMap<HostKey, Origin> hosts_;   ///< no empty entries
    PoolMap<Client, Source> clients_;  ///< likewise
    WaitingReads reads_;
    PoolMultiset<TimePoint> expiries_;  ///< of all waiting jobs
    std::size_t size_ = 0;
    /// By class: hosts with a lane whose first job is of the class, in the order of their turns.
    std::array<PoolMap<std::uint64_t, HostKey>, kRanks> rounds_;
    std::uint64_t turns_ = 0;
    /// Turns of other classes while one of this class was runnable.
    std::array<int, kRanks> passed_{};
    bool last_was_passed_over_ = false;
};

class JobQueue::Choice {
  public:
    /// Null: none is runnable.
    const Job* job() const { return rank_ < kRanks ? first_[rank_].first : nullptr; }

  private:
    friend class JobQueue;
    /// The first runnable one of each class, and where it waits.
    std::array<std::pair<const Job*, Place>, kRanks> first_;
    std::size_t rank_ = kRanks;
    bool passed_over_ = false;
};

}  // namespace panelgate::arbiter
