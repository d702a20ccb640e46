#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "panelgate/base/time.hpp"
#include "panelgate/store/counters.hpp"
#include "panelgate/store/database.hpp"
#include "panelgate/store/settings.hpp"

namespace panelgate::store {

/// The database behind a bounded queue, with a thread of its own: no line waits for a disk. Writes
/// that wait are carried out together, in one transaction, once a second or when somebody asks.
/// Used by one thread besides its own.
class Store {
  public:
    /// What the owner should say in the log; called from the store's thread. Not failing: `why` is
    /// about the file that was found, or empty when writes are taken again.
    using Tell = std::function<void(bool failing, const std::string& why)>;

    /// `wall` is called from the store's thread.
    Store(Settings settings, std::function<WallTime()> wall, Tell tell);
    ~Store();  ///< as end()
    Store(const Store&) = delete;
    Store& operator=(const Store&) = delete;

    /// Writes what waits, once, and ends the thread. Any thread.
    void end();
    /// Carries out a write soon; counted as lost where queue or disk do not take the write.
    void put(std::function<void(Database&)> write);
    /// Carries out a read behind the writes that wait. `read` gets nullptr while the file cannot be
    /// opened; it runs in the store's thread and must not throw anything but SQLite's errors, after
    /// which it is called with nullptr.
    void ask(std::function<void(Database*)> read);
    Counters counters() const;
    /// Why nothing can be written; "": writes are taken.
    std::string why() const;

  private:
    struct Task {
        bool is_read = false;
        std::function<void(Database*)> work{};
    };

    void run();
    bool take(std::deque<Task>& tasks);
    void work(const std::deque<Task>& tasks);
    bool ensure_open();
    void write(const std::deque<Task>& tasks);
    void look_after();
    void settle(const std::string& why, std::size_t written, std::size_t lost);

    mutable std::mutex mutex_;  ///< of the members down to stop_
    std::condition_variable wake_;
    std::deque<Task> waiting_;
    std::size_t writes_ = 0;  ///< in waiting_
    Counters counters_;
    std::string why_;
    bool stop_ = false;

    Settings settings_;  ///< of the thread, as what follows
    std::function<WallTime()> wall_;
    Tell tell_;
    std::unique_ptr<Database> database_;
    unsigned pause_ = 0;  ///< rounds until the file is tried again
    WallTime seen_{};
    WallTime prune_at_{};
    std::thread thread_;
};

}  // namespace panelgate::store
