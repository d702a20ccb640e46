#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <utility>

#include "panelgate/base/fault.hpp"
#include "panelgate/base/pool.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/who.hpp"
#include "panelgate/base/words.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::arbiter {

struct QueueSettings {
    std::size_t limit = 256;      ///< requests that wait on this line
    std::size_t per_client = 32;  ///< of one client
    Duration deadline = 2s;       ///< of a request, from its arrival to its answer
    friend bool operator==(const QueueSettings&, const QueueSettings&) = default;
};

/// A transaction is one request on the wire, numbered per line from 1.
using Transaction = std::uint64_t;

/// The transactions made for a job, oldest first. Most jobs have one, without heap memory.
class TransactionNumbers {
  public:
    void add(Transaction number) {
        if (last_ != 0) before_.push_back(last_);
        last_ = number;
    }
    /// 0: it was never sent.
    Transaction last() const { return last_; }
    template <class Each>
    void for_each(Each each) const {
        for (const Transaction number : before_) each(number);
        if (last_ != 0) each(last_);
    }

  private:
    Transaction last_ = 0;
    PoolVector<Transaction> before_;
};

/// Identifies one accepted job; never reused.
using Ticket = std::uint64_t;
using modbus::kBroadcast;
using Client = std::uint64_t;
/// Where a client comes from: the same for all connections from one address.
using Host = std::uint64_t;

/// One request and its state.
struct Job {
    Ticket ticket = 0;         ///< given by the arbiter
    std::uint8_t station = 0;  ///< 0: broadcast
    modbus::Request request;
    Client client = 0;
    Host host = 0;  ///< 0: the client counts as its own host
    PriorityClass priority = PriorityClass::read;
    /// The function the client asked for, where the request uses another one instead; 0: the same.
    std::uint8_t asked_function = 0;
    Duration within = Duration::max();  ///< its time limit, if sooner than the queue's
    /// A scan: unheard stations are asked though offline; their silence says nothing of the line.
    bool search = false;
    TimePoint arrived{};
    TimePoint deadline{};
    TimePoint start_by{};               ///< the last moment at which starting it makes sense
    int attempts = 0;                   ///< transmissions so far
    bool alone = false;                 ///< a shared transaction for it was refused: send it alone
    bool gone = false;                  ///< its client has left while it was on the wire: no retry
    TransactionNumbers transactions{};  ///< one for each attempt
    WhoRef who{};                       ///< who asks, for those who judge it again
    bool raw = false;                   ///< ... and whether its client has made the PDU
    bool barred = false;                ///< forbidden since it was sent: no retry
};
using Jobs = PoolVector<Job>;

/// Removes and returns the jobs that match.
template <class Match>
Jobs take_if(Jobs& jobs, const Match& match) {
    Jobs taken;
    if (std::ranges::none_of(jobs, match)) return taken;
    std::ranges::copy_if(jobs, std::back_inserter(taken), match);
    std::erase_if(jobs, match);
    return taken;
}

/// How much of the line's time each client has used (P9). A shared transaction is split equally.
/// Bounded; a client that has gone is forgotten. Pure.
class BusShares {
  public:
    static constexpr std::size_t kClients = 1024;

    struct Share {
        Duration busy{};
        std::uint64_t transactions = 0;
    };

    void add(Client client, Duration busy) {
        if (!shares_.contains(client) && shares_.size() >= kClients) return;
        shares_[client].busy += busy;
        ++shares_[client].transactions;
    }
    void forget(Client client) { shares_.erase(client); }
    /// All zero if nothing was used yet.
    Share of(Client client) const {
        const auto known = shares_.find(client);
        return known == shares_.end() ? Share{} : known->second;
    }
    const std::map<Client, Share>& all() const { return shares_; }

  private:
    std::map<Client, Share> shares_;
};

}  // namespace panelgate::arbiter
