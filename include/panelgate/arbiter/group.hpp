#pragma once

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <optional>

#include "panelgate/arbiter/job.hpp"
#include "panelgate/arbiter/transaction_numbers.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/span.hpp"

namespace panelgate::arbiter {

/// Jobs that one transaction answers, and its request. jobs[0] leads; a probe has none.
struct Group {
    Jobs jobs{};
    std::uint8_t station = 0;
    modbus::Request request;
    std::optional<modbus::Span> span{};  ///< of a read that can be shared
    int attempts = 0;
    Transaction transaction = 0;  ///< of the last attempt
    TimePoint started{};          ///< the first attempt: what answers was not read before
    Duration silent_after{};  ///< how long the attempt before was waited for in vain; 0: it was not
    Duration
        cut_after{};  ///< the attempt before, whose reply broke off, took so long; 0: it did not
    Bytes doubted{};  ///< the attempt before was answered so, and it may be a copy; or nothing
    TimePoint doubted_at{};  ///< when that came
    bool probe = false;
    bool told_apart = false;  ///< ... of a length that nothing outstanding has (Station::proof)
    /// It is a read that tells whether the reply to the write of its jobs was that write's echo;
    /// their answer, where it was not.
    Bytes confirms{};
    bool repeatable = true;      ///< its station's `retry_writes` when it began, of a write
    bool first_silence = false;  ///< its station was well when it was first sent
    /// It only finds out about the echo, for this job, which waits in the queue.
    Ticket learns_for = 0;

    /// It asks for more than any of its jobs.
    bool joined() const {
        return !jobs.empty() &&
               std::ranges::none_of(jobs, [&](const Job& job) { return job.request == request; });
    }
    bool has(Client client, std::uint8_t to) const {
        return (station == to || station == 0) &&
               std::ranges::any_of(jobs, [&](const Job& job) { return job.client == client; });
    }
    void on_gone(Client client) {
        for (Job& job : jobs) job.gone = job.gone || job.client == client;
    }
    /// Those whose own deadline has come; the others go on waiting.
    Jobs expire(TimePoint now) {
        const auto late = [&](const Job& job) { return job.deadline <= now; };
        Jobs expired;
        std::ranges::copy_if(jobs, std::back_inserter(expired), late);
        std::erase_if(jobs, late);
        return expired;
    }
    /// What may be a copy is no answer to it before it was asked once more: values, for clients. A
    /// refusal is not asked for again; it may well be gone by then.
    bool may_doubt(ByteView reply) const {
        return is_values(reply) && doubted.empty() && !jobs.empty();
    }
    /// A refusal of it may be asked for once more.
    bool may_doubt_refusal() const {
        return request.is_read() && doubted.empty() && !jobs.empty() && confirms.empty();
    }
    /// This reply to it holds values: it is a read, and not refused.
    bool is_values(ByteView reply) const {
        return request.is_read() && reply[0] == request.function();
    }
    /// What answers a retry behind a wait may be the reply to the attempt before: it tells nothing.
    bool tells_pace() const { return silent_after + cut_after == Duration::zero(); }
    /// Nobody waits for it any more.
    bool abandoned() const { return std::ranges::all_of(jobs, &Job::gone); }
};

}  // namespace panelgate::arbiter
