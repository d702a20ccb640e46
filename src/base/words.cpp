#include "panelgate/base/words.hpp"

#include <cstdlib>

namespace panelgate {

std::string_view label(EchoState state) {
    switch (state) {
        case EchoState::unknown:
            return "unknown";
        case EchoState::absent:
            return "absent";
        case EchoState::present:
            return "present";
    }
    std::abort();
}

FrameDirection direction_of(FrameKind kind) {
    switch (kind) {
        case FrameKind::request:
        case FrameKind::retry:
        case FrameKind::probe:
        case FrameKind::learn_echo:
        case FrameKind::broadcast:
            return FrameDirection::sent;
        case FrameKind::reply:
        case FrameKind::heard_request:
            return FrameDirection::received;
        case FrameKind::damaged:
        case FrameKind::echo:
        case FrameKind::foreign_request:
        case FrameKind::late:
        case FrameKind::copy:
        case FrameKind::foreign:
            return FrameDirection::discarded;
    }
    std::abort();
}

std::string_view label(FrameKind kind) {
    switch (kind) {
        case FrameKind::request:
            return "request";
        case FrameKind::retry:
            return "retry";
        case FrameKind::probe:
            return "probe";
        case FrameKind::learn_echo:
            return "learn echo";
        case FrameKind::broadcast:
            return "broadcast";
        case FrameKind::reply:
            return "reply";
        case FrameKind::heard_request:
            return "heard request";
        case FrameKind::damaged:
            return "damaged";
        case FrameKind::echo:
            return "echo";
        case FrameKind::foreign_request:
            return "foreign request";
        case FrameKind::late:
            return "late";
        case FrameKind::copy:
            return "copy";
        case FrameKind::foreign:
            return "foreign";
    }
    std::abort();
}

std::string_view label(FrameDirection direction) {
    switch (direction) {
        case FrameDirection::sent:
            return "sent";
        case FrameDirection::received:
            return "received";
        case FrameDirection::discarded:
            return "discarded";
    }
    std::abort();
}

std::string_view label(Health health) {
    switch (health) {
        case Health::unknown:
            return "unknown";
        case Health::online:
            return "online";
        case Health::suspect:
            return "suspect";
        case Health::heard:
            return "heard";
        case Health::offline:
            return "offline";
    }
    std::abort();
}

std::string_view label(Condition condition) {
    switch (condition) {
        case Condition::well:
            return "well";
        case Condition::unheard:
            return "unheard";
        case Condition::missed:
            return "missed";
        case Condition::flaky:
            return "flaky";
        case Condition::failing:
            return "failing";
        case Condition::offline:
            return "offline";
    }
    std::abort();
}

std::string_view label(PriorityClass priority) {
    switch (priority) {
        case PriorityClass::write:
            return "write";
        case PriorityClass::read:
            return "read";
        case PriorityClass::poll:
            return "poll";
        case PriorityClass::probe:
            return "probe";
    }
    std::abort();
}

std::string_view label(Outcome outcome) {
    switch (outcome) {
        case Outcome::ok:
            return "ok";
        case Outcome::exception:
            return "exception";
        case Outcome::timeout:
            return "timeout";
        case Outcome::damaged:
            return "damaged";
        case Outcome::refused:
            return "refused";
        case Outcome::busy:
            return "busy";
        case Outcome::expired:
            return "expired";
        case Outcome::cancelled:
            return "cancelled";
        case Outcome::offline:
            return "offline";
        case Outcome::line_down:
            return "line_down";
        case Outcome::cached:
            return "cached";
        case Outcome::shared:
            return "shared";
    }
    std::abort();
}

std::string_view label(TransactionEnd end) {
    switch (end) {
        case TransactionEnd::open:
            return "open";
        case TransactionEnd::ok:
            return "ok";
        case TransactionEnd::exception:
            return "exception";
        case TransactionEnd::timeout:
            return "timeout";
        case TransactionEnd::damaged:
            return "damaged";
        case TransactionEnd::wrong:
            return "wrong";
        case TransactionEnd::doubtful:
            return "doubtful";
        case TransactionEnd::line_down:
            return "line_down";
    }
    std::abort();
}

bool is_error(TransactionEnd end) {
    switch (end) {
        case TransactionEnd::open:
        case TransactionEnd::ok:
        case TransactionEnd::exception:
        case TransactionEnd::doubtful:
            return false;
        case TransactionEnd::timeout:
        case TransactionEnd::damaged:
        case TransactionEnd::wrong:
        case TransactionEnd::line_down:
            return true;
    }
    std::abort();
}

}  // namespace panelgate
