#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "panelgate/arbiter/queue/job.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/pool.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::arbiter {

/// The jobs that one transaction answers, and its request. jobs[0] leads; a probe has none.
struct Group {
    Jobs jobs{};
    std::uint8_t station = 0;
    modbus::Request request;
    std::optional<modbus::Span> span{};  ///< of a read that can be shared
    int attempts = 0;
    Transaction transaction = 0;  ///< of the latest attempt
    TimePoint started{};          ///< of the first attempt: the answer was sampled at or after it
    Duration silent_after{};      ///< wait of the previous attempt; 0: it was not silent
    Duration cut_after{};    ///< duration of the previous attempt if its reply broke off, else 0
    Bytes doubted{};         ///< reply to the previous attempt that may be a duplicate; or empty
    TimePoint doubted_at{};  ///< time of that reply
    bool doubted_as_early = false;
    bool probe = false;
    bool distinct_length = false;  ///< its reply's length differs from all outstanding ones
    /// Set if this read checks whether the reply to a write was that write's echo, or a broadcast's
    /// answer: the answer for the jobs if it was not.
    Bytes confirms{};
    Bytes written{};             ///< the request of that write
    bool repeatable = true;      ///< of a write: the station's `retry_writes` when it began
    bool first_silence = false;  ///< its station was healthy when it was first sent
    /// The queued job for which this read only detects the echo.
    Ticket learns_for = 0;
    PoolVector<Bytes> said{};  ///< values that came for the attempts before, where they differed
    int doubts = 0;            ///< attempts whose answer was doubtful
    bool odd_pace = false;     ///< its reply began before it had left, where that is unusual
    bool early_may_be_old = false;  ///< one that was doubted as early may be another request's

    static constexpr int kMostDoubts = 2;  ///< after which there is no sure answer

    /// True if it asks for more than any of its jobs.
    bool joined() const {
        return !jobs.empty() &&
               std::ranges::none_of(jobs, [&](const Job& job) { return job.request == request; });
    }
    bool has(Client client, std::uint8_t to) const {
        return (station == to || station == 0) &&
               std::ranges::any_of(jobs, [&](const Job& job) { return job.client == client; });
    }
    void on_client_gone(Client client) {
        for (Job& job : jobs) job.gone = job.gone || job.client == client;
    }
    /// Removes and returns the jobs whose own deadline has passed; the others keep waiting.
    Jobs expire(TimePoint now) {
        return take_if(jobs, [&](const Job& job) { return job.deadline <= now; });
    }
    /// True if a reply that may be a duplicate must be confirmed by asking again: values, for
    /// clients. Exceptions are not asked for again; they may be gone by then.
    bool may_doubt(ByteView reply) const { return is_values(reply) && !jobs.empty(); }
    /// True if an exception reply to it may be confirmed by asking again.
    bool may_doubt_refusal() const {
        return request.is_read() && doubted.empty() && !jobs.empty() && confirms.empty();
    }
    /// True if the reply holds values: the request asks for some, and it was not refused.
    bool is_values(ByteView reply) const {
        return modbus::returns_values(request.pdu()) && reply[0] == request.function();
    }
    /// True if an earlier attempt had these values, too, among others.
    bool was_said(ByteView reply) const {
        return std::ranges::any_of(
            said, [&](const Bytes& one) { return std::ranges::equal(one, reply); });
    }
    /// True if its reply shows the station's pace: the reply to a retry may answer the attempt
    /// before.
    bool shows_pace() const { return silent_after + cut_after == Duration::zero() && !odd_pace; }
    /// True if a poll has brought it its turn.
    bool is_poll() const { return !jobs.empty() && jobs.front().priority == PriorityClass::poll; }
    /// True if no client waits for it any more.
    bool abandoned() const { return std::ranges::all_of(jobs, &Job::gone); }
};

}  // namespace panelgate::arbiter
