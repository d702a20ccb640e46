#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>

#include "panelgate/arbiter/book/timing.hpp"
#include "panelgate/arbiter/habits/reply_times.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

/// When the bytes of one attempt are worth a look. Where they come one by one at the line's rate,
/// none decides before a header, an echo or the whole reply can be there. Pure.
class InputPace {
  public:
    struct Line {
        Duration byte{};          ///< time of one, at least
        bool steady = false;      ///< bytes arrive one by one, at the line's rate
        Duration wake_latency{};  ///< of the line
        Drift drift;              ///< of the station's clock
    };
    explicit InputPace(const Line& line) : line_(line) {}

    struct Look {
        TimePoint at;
        Duration reply{};  ///< at the line's rate, from its beginning until then
        bool end = false;  ///< the whole reply is expected then
    };
    /// True if the line has kept its rate so far, and something has begun.
    bool is_kept() const { return line_.steady && !hasty_ && began_; }
    /// Since it began.
    std::size_t bytes() const { return since_; }
    /// When `missing` more bytes can be there, that end the reply, or only a part of it. Empty:
    /// the next byte decides.
    std::optional<Look> look(std::size_t missing, bool end) const;
    /// Until then nothing decides. A reply that was cut short is noticed before twice its time so
    /// far.
    TimePoint busy_until(const Look& next) const;

    /// These bytes were read now.
    void on_read(TimePoint now, std::size_t bytes);
    /// All before the last `rest` bytes was our echo.
    void restart(TimePoint now, std::size_t rest);
    /// What was read now has been judged: `planned` was the look before it.
    void on_judged(TimePoint now, const std::optional<Look>& planned, bool replied);
    /// More should have come by now (a hole, or a slower clock): the next byte decides.
    void drop_if_late(TimePoint now, const std::optional<TimePoint>& busy);

    /// Result of the first read at the expected end of a reply: its duration at the line's rate,
    /// and whether all of it was there.
    struct EndLook {
        Duration reply{};
        bool whole = false;
    };
    const std::optional<EndLook>& end_look() const { return end_look_; }
    /// True if the reply was shorter than expected: an exception.
    bool is_shorter() const { return shorter_; }
    /// True if bytes came faster than the line's rate allows since the reply began.
    bool hasty() const { return hasty_; }

  private:
    /// Late reading or late notification does not make the line slower.
    Duration slack() const { return std::max(2 * line_.byte, timing::kReadingSlack); }
    TimePoint latest(TimePoint now) const { return now - since_ * line_.byte; }

    Line line_;
    /// When the input began, if the line has kept its rate since; empty: the next byte decides.
    std::optional<TimePoint> began_;
    std::size_t since_ = 0;  ///< bytes since then
    TimePoint looked_{};     ///< when bytes were last read
    std::optional<EndLook> end_look_;
    bool shorter_ = false;
    bool hasty_ = false;
};

}  // namespace panelgate::arbiter
