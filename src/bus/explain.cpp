#include "client_names.hpp"

#include <algorithm>
#include <cstdlib>

#include "panelgate/base/words.hpp"

namespace panelgate::bus {

namespace {

using arbiter::Decision;
using arbiter::Reason;

std::string ms(Duration duration) {
    const auto tenths = duration / 100us;
    return std::to_string(tenths / 10) + '.' + std::to_string(tenths % 10) + " ms";
}

/// "read of modbus_tcp 10.0.0.5:50012 to station 17"; a poller's name already says what it polls.
std::string describe(PriorityClass priority, const ClientName& client, std::uint8_t station) {
    const std::string own = std::string(label(priority)) + " of ";
    const std::string name = ClientNames::words(client);
    if (name.starts_with(own)) return name;
    return own + name + " to station " + std::to_string(station);
}

/// A request that is sent.
std::string turn(const Reason& reason, const ClientName& client) {
    const std::string text = describe(reason.priority, client, reason.station) + ": ";
    const std::string instead =
        reason.asked_function == 0
            ? ""
            : ", instead of function " + std::to_string(reason.asked_function);
    if (reason.kind == Reason::Kind::again)
        return text + "attempt " + std::to_string(reason.attempt) + instead;
    return text + "next in turn after " + ms(reason.waited) + ", " +
           std::to_string(reason.waiting) + " wait" +
           (reason.passed_over ? ", ahead of a higher class that has had its turns" : "") +
           (reason.answers > 1 ? ", answers " + std::to_string(reason.answers) + " requests in one"
                               : "") +
           instead;
}

/// What goes with it; the word itself decides nothing.
std::string means(Condition condition) {
    switch (condition) {
        case Condition::well:
            return "its reads are retried as configured";
        case Condition::unheard:
            return "it has not been heard yet";
        case Condition::missed:
            return "its next request is not retried";
        case Condition::flaky:
            return "half of its last attempts were silent; others who wait go first";
        case Condition::failing:
            return "no retries, and with other suspects a fifth of the line's time at most";
        case Condition::offline:
            return "only probes are sent";
    }
    std::abort();
}

}  // namespace

std::string text_of(const Reason& reason, const ClientName& client) {
    switch (reason.kind) {
        case Reason::Kind::none:
            return "";
        case Reason::Kind::learns_echo:
            return "a write is next and it is unknown whether this line has an echo";
        case Reason::Kind::probe:
            return "the station is offline and its probe is due";
        case Reason::Kind::again:
        case Reason::Kind::turn:
            return turn(reason, client);
    }
    std::abort();
}

std::string text_of(const Decision& decision, const ClientName& client,
                    const arbiter::QueueSettings& queue) {
    const std::string station = "station " + std::to_string(decision.station);
    const std::string request = describe(decision.priority, client, decision.station);
    const std::string count = std::to_string(decision.count);
    switch (decision.kind) {
        case Decision::Kind::offline:
            return request + " refused: offline after " + count +
                   " silent transactions, next probe in " +
                   ms(std::max(decision.time, Duration::zero()));
        case Decision::Kind::full:
            return request + " refused: " + count + " of " + std::to_string(queue.limit) +
                   " wait on this line, at most " + std::to_string(queue.per_client) +
                   " of one client";
        case Decision::Kind::shed:
            return request + " given up: the queue is full, and its host has the most waiting";
        case Decision::Kind::expired:
            return request + " given up after " + ms(decision.time) +
                   ": it could not end before its deadline";
        case Decision::Kind::unanswered:
            return request + " given up after " + ms(decision.time) +
                   ": no answer before its deadline";
        case Decision::Kind::condition:
            return station + " is " + std::string(label(decision.condition)) +
                   " now: " + means(decision.condition);
        case Decision::Kind::line_rests:
            return "only this request is sent for " + ms(decision.time) + ": " + station +
                   " did not answer and may do so late";
    }
    std::abort();
}

}  // namespace panelgate::bus
