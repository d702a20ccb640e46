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

/// The requests that wait for one line. A client's own requests keep their order; between clients
/// the class of each one's first request decides, and inside a class they take turns.
class JobQueue {
  public:
    explicit JobQueue(const QueueSettings& settings) : settings_(settings) {}

    /// No room for another request of this client (P9: the answer is 06, at once).
    bool full(Client client) const;
    /// Adds behind the client's other requests; the caller has asked full().
    void push(Job job);
    /// Puts a job back that was taken: before the client's others, though other clients go first.
    void put_back(Job job);
    /// The next one in turn, or nullptr; pop() takes it.
    const Job* peek() const;
    std::optional<Job> pop();
    /// Removes and returns all that match, in order of arrival.
    std::vector<Job> remove_if(const std::function<bool(const Job&)>& match);

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
    Lane& lane(Client client);
    Lanes::const_iterator next() const;

    QueueSettings settings_;
    Lanes lanes_;  ///< never an empty lane
    std::size_t size_ = 0;
    std::uint64_t turns_ = 0;
};

}  // namespace panelgate::arbiter
