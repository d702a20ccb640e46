#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "panelgate/arbiter/job.hpp"
#include "panelgate/arbiter/settings.hpp"

namespace panelgate::arbiter {

/// The requests that wait for one line. A client's own requests keep their order (it never reads
/// older than its own write); between clients the class of each one's first request decides, inside
/// a class they take turns, and what has waited long goes ahead of a higher class every other time,
/// so that every class progresses and a write still starts within two transactions (P9).
class JobQueue {
  public:
    using Test = std::function<bool(const Job&)>;

    explicit JobQueue(const QueueSettings& settings) : settings_(settings) {}

    /// No room for another request of this client (P9: the answer is 06, at once).
    bool full(Client client) const;
    /// Adds behind the client's other requests; the caller has asked full().
    void push(Job job);
    /// Puts a job back that was taken: before the client's others, though other clients go first.
    void put_back(Job job);
    /// The next one in turn of those that may run, or nullptr; pop() with the same arguments takes
    /// it.
    const Job* peek(TimePoint now, const Test& may_run) const;
    std::optional<Job> pop(TimePoint now, const Test& may_run);
    /// Takes some client's first request that matches; the client keeps its turn.
    std::optional<Job> take_first(const Test& wanted);
    /// Removes and returns all that match, in order of arrival.
    std::vector<Job> remove_if(const Test& match);
    /// Shows each client's first request.
    void each_first(const std::function<void(const Job&)>& show) const;

    /// The one that was taken last went ahead of a higher class because of its age.
    bool last_was_aged() const { return last_was_aged_; }
    bool has(Client client) const { return lanes_.contains(client); }
    std::size_t size() const { return size_; }
    bool empty() const { return size_ == 0; }
    /// The earliest start_by of all.
    std::optional<TimePoint> first_expiry() const;

  private:
    struct Lane {
        std::deque<Job> jobs;
        std::uint64_t turn = 0;  ///< smaller goes first
    };
    using Lanes = std::map<Client, Lane>;
    struct Choice {
        Lanes::const_iterator lane;
        bool aged = false;  ///< it overtakes a higher class
    };
    Lane& lane(Client client);
    Choice choose(TimePoint now, const Test& may_run) const;
    bool is_aged(TimePoint now, const Job& job, PriorityClass over) const;
    Job take(Lanes::const_iterator it);

    QueueSettings settings_;
    Lanes lanes_;  ///< never an empty lane
    std::size_t size_ = 0;
    std::uint64_t turns_ = 0;
    bool last_was_aged_ = false;
};

}  // namespace panelgate::arbiter
