#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "panelgate/arbiter/queue/job.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::arbiter {

/// The jobs that one transaction answers, and its request. jobs[0] leads; a probe has no jobs.
struct Group {
    Jobs jobs{};
    std::uint8_t station = 0;
    modbus::Request request;
    std::optional<modbus::Span> span{};  ///< of a read that can be shared
    int attempts = 0;
    Transaction transaction = 0;  ///< of the latest attempt
    TimePoint started{};          ///< of the first attempt: the answer was sampled then or later
    bool silent = false;          ///< the previous attempt was silent
    bool probe = false;           ///< shows whether an offline station is back, or is a proof (T2)
    bool repeatable = true;       ///< of a write: the station's `retry_writes` when it began
    bool was_online = false;      ///< its station was online when it was first sent
    Ticket learns_for = 0;        ///< the queued write for which this read shows the echo (T6)

    /// True if it asks for more than any of its jobs.
    bool joined() const {
        return !jobs.empty() &&
               std::ranges::none_of(jobs, [&](const Job& job) { return job.request == request; });
    }
    bool has(Client client, std::uint8_t to) const {
        return (station == to || station == kBroadcast) &&
               std::ranges::any_of(jobs, [&](const Job& job) { return job.client == client; });
    }
    void on_client_gone(Client client) {
        for (Job& job : jobs) job.gone = job.gone || job.client == client;
    }
    /// Removes and returns the jobs whose own deadline has passed; the others keep waiting.
    Jobs expire(TimePoint now) {
        return take_if(jobs, [&](const Job& job) { return job.deadline <= now; });
    }
    /// True if another attempt could still answer one of the jobs in time.
    bool in_time(TimePoint now) const {
        return std::ranges::any_of(jobs, [&](const Job& job) { return now < job.start_by; });
    }
    /// True if no client waits for it any more.
    bool abandoned() const { return std::ranges::all_of(jobs, &Job::gone); }
};

}  // namespace panelgate::arbiter
