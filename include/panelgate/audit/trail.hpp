#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "panelgate/audit/chain.hpp"
#include "panelgate/audit/counters.hpp"
#include "panelgate/audit/settings.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::audit {

/// What the owner of a trail should say in the log.
struct Notice {
    enum class Kind : std::uint8_t { failing, recovered, anchor, remark };
    Kind kind = Kind::failing;
    std::string text{};  ///< why; the remark
    Position at{};       ///< of an anchor; `text` is its chain's id
};

/// The audit trail. The loop only appends bodies to a bounded buffer; a thread chains them, writes
/// them and synchronizes the file, at most Settings::flush later. While the disk takes nothing the
/// buffer fills, and then what comes is counted as lost, and the count recorded. Used by one thread
/// besides its own.
class Trail {
  public:
    /// `tell` is called from the trail's thread. `wall` too: it tells the time of what the trail
    /// itself records. `start`: further members of the record `start`, such as
    /// `,"version":"1.0.0"`.
    struct Hooks {
        std::function<void(Notice)> tell;
        std::function<WallTime()> wall;
        std::string start;
    };

    Trail(const Settings& settings, Hooks hooks);
    /// As close().
    ~Trail();
    Trail(const Trail&) = delete;
    Trail& operator=(const Trail&) = delete;

    /// Adds a record (Composer::body()).
    void add(std::string_view body);
    /// From the next write on. Another file begins with a record `start`.
    void apply(const Settings& settings);
    /// True while nothing can be written, or there is no room.
    bool is_failing() const { return failing_.load(std::memory_order_relaxed); }
    Counters counters() const;
    /// How it ended.
    struct End {
        Position last{};  ///< the last record that is on the disk
        std::string chain{};
        std::uint64_t unwritten = 0;  ///< records that the disk has not taken
    };
    /// Writes what waits, tries for no longer than the disk takes to answer, and ends the thread.
    End close();

  private:
    struct State;
    std::unique_ptr<State> state_;
    std::atomic<bool> failing_{false};
};

}  // namespace panelgate::audit
