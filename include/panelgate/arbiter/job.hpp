#pragma once

#include <cstdint>

#include "panelgate/arbiter/transaction_numbers.hpp"
#include "panelgate/base/fault.hpp"
#include "panelgate/base/pool.hpp"
#include "panelgate/base/priority.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::arbiter {

/// Names one accepted job; never reused.
using Ticket = std::uint64_t;
using Client = std::uint64_t;
/// Where a client comes from: all connections from one address have the same.
using Host = std::uint64_t;

/// One request on its way.
struct Job {
    Ticket ticket = 0;         ///< given by the arbiter
    std::uint8_t station = 0;  ///< 0: broadcast
    modbus::Request request;
    Client client = 0;
    Host host = 0;  ///< 0: the client is its own
    PriorityClass priority = PriorityClass::read;
    /// The function that was asked for, where the request has another one instead; 0: its own.
    std::uint8_t asked_function = 0;
    Duration within = Duration::max();  ///< its deadline, where the queue's is not sooner
    /// Its reply is waited for at least so long (within the response timeout), also of a station
    /// that nobody knows.
    Duration patience{};
    /// A search that keeps to a share of its own: silent strangers are asked without their budget,
    /// and their silence tells nothing about the line.
    bool search = false;
    TimePoint arrived{};
    TimePoint deadline{};
    TimePoint start_by{};  ///< the last moment at which starting it makes sense
    int attempts = 0;      ///< transmissions so far
    bool alone = false;    ///< a shared transaction for it was refused: ask for just this
    bool gone = false;     ///< its client has left while it was on the wire: no further attempt
    TransactionNumbers transactions{};  ///< one for each attempt
};
using Jobs = PoolVector<Job>;

}  // namespace panelgate::arbiter
