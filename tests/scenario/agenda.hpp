#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <queue>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::scenario {

/// Virtual time: what happens when. Of one instant, what was put in first goes first.
class Agenda {
  public:
    TimePoint now() const { return now_; }
    TimePoint started() const { return started_; }

    void at(TimePoint when, std::function<void()> happen) {
        events_.push({when, ++order_, std::move(happen)});
    }
    std::optional<TimePoint> next() const {
        return events_.empty() ? std::nullopt : std::optional(events_.top().at);
    }
    void happen_next() {
        const Event event = events_.top();
        events_.pop();
        now_ = std::max(now_, event.at);
        event.happen();
    }
    void advance_to(TimePoint when) { now_ = std::max(now_, when); }

    /// Keeps the last things that happened, for a replay.
    void keep_history() { keeps_history_ = true; }
    void tell(std::string_view what, ByteView bytes = {}) {
        if (!keeps_history_) return;
        constexpr std::size_t kKept = 20000;
        history_.push_back(std::to_string((now_ - started_) / 1us) + " us  " + std::string(what) +
                           "  " + to_hex(bytes));
        if (history_.size() > kKept) history_.pop_front();
    }
    std::string history() const {
        std::string text;
        for (const std::string& line : history_) text += "  " + line + '\n';
        return text;
    }

  private:
    struct Event {
        TimePoint at;
        std::uint64_t order = 0;
        std::function<void()> happen;
        bool operator>(const Event& other) const {
            return at != other.at ? at > other.at : order > other.order;
        }
    };

    TimePoint started_{1h};
    TimePoint now_ = started_;
    std::uint64_t order_ = 0;
    std::priority_queue<Event, std::vector<Event>, std::greater<>> events_;
    bool keeps_history_ = false;
    std::deque<std::string> history_;
};

}  // namespace panelgate::scenario
