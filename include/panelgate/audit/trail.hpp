#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "panelgate/audit/chain.hpp"
#include "panelgate/audit/counters.hpp"
#include "panelgate/audit/record.hpp"
#include "panelgate/audit/settings.hpp"
#include "panelgate/audit/writer.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::audit {

/// What the owner of a trail should say in the log.
struct Notice {
    enum class Kind : std::uint8_t { failing, recovered, anchor, remark };
    Kind kind = Kind::failing;
    std::string text{};  ///< why; the remark
    Position at{};       ///< of an anchor; `text` is its chain's id
};

/// The audit trail of one file. The loop only appends records to a bounded buffer; a thread chains
/// them, writes them and synchronizes the file, at most Settings::flush later. While the disk takes
/// nothing the buffer fills, and then what comes is counted as lost, and the count recorded. Used
/// by one thread besides its own.
class Trail {
  public:
    /// `tell` and `wall` are called from the trail's thread. `start`: further members of the record
    /// `start`.
    struct Hooks {
        std::function<void(Notice)> tell;
        std::function<WallTime()> wall;
        Members start;
    };

    Trail(const Settings& settings, Hooks hooks);
    ~Trail();  ///< as close()
    Trail(const Trail&) = delete;
    Trail& operator=(const Trail&) = delete;

    void add(const Members& record);
    /// From the next write on. The file stays.
    void apply(const Settings& settings);
    /// With `failing` while nothing can be written.
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
    void run();
    bool wait(std::unique_lock<std::mutex>& lock);
    void take_over();
    void work();
    void anchor();

    mutable std::mutex mutex_;  ///< of the members down to stop_
    std::condition_variable wake_;
    Settings settings_;
    std::string pending_;     ///< bodies, each with a newline behind it
    std::uint64_t lost_ = 0;  ///< not yet recorded
    Counters counters_;
    bool stop_ = false;

    Hooks hooks_;  ///< of the thread, as what follows
    Writer writer_;
    std::string batch_;  ///< bodies that were taken over and are not on the disk
    bool failing_ = false;
    std::uint64_t anchored_ = 0;
    WallTime anchored_at_{};
    std::thread thread_;
};

}  // namespace panelgate::audit
