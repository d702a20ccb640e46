#include "panelgate/store/store.hpp"

#include <algorithm>
#include <exception>
#include <utility>

#include "panelgate/base/thread.hpp"
#include "statement.hpp"

namespace panelgate::store {

namespace {

constexpr std::chrono::seconds kFlush{1};
constexpr std::chrono::hours kPrune{1};
constexpr std::chrono::hours kStep{24};  // of a clock that was set
constexpr unsigned kAgain = 10;          // rounds between two tries to open the file

}  // namespace

Store::Store(Settings settings, std::function<WallTime()> wall, Tell tell)
    : settings_(std::move(settings)), wall_(std::move(wall)), tell_(std::move(tell)) {
    thread_ = start_thread([this] { run(); });
}

Store::~Store() { end(); }

void Store::end() {
    if (!thread_.joinable()) return;
    {
        const std::scoped_lock lock(mutex_);
        stop_ = true;
    }
    wake_.notify_one();
    thread_.join();
}

void Store::put(std::function<void(Database&)> write) {
    const std::scoped_lock lock(mutex_);
    if (writes_ >= settings_.queue) {
        ++counters_.lost;
        return;
    }
    ++writes_;
    waiting_.push_back({false, [write = std::move(write)](Database* to) { write(*to); }});
}

void Store::ask(std::function<void(Database*)> read) {
    {
        const std::scoped_lock lock(mutex_);
        waiting_.push_back({true, std::move(read)});
    }
    wake_.notify_one();
}

Counters Store::counters() const {
    const std::scoped_lock lock(mutex_);
    Counters counters = counters_;
    counters.waiting = writes_;
    return counters;
}

std::string Store::why() const {
    const std::scoped_lock lock(mutex_);
    return why_;
}

void Store::run() {
    std::deque<Task> tasks;
    for (bool more = true; more;) {
        more = take(tasks);
        work(tasks);
        tasks.clear();
    }
}

/// Waits for a read, or until it is time to write. Returns false at the end.
bool Store::take(std::deque<Task>& tasks) {
    std::unique_lock lock(mutex_);
    wake_.wait_for(lock, kFlush,
                   [this] { return stop_ || (!waiting_.empty() && waiting_.back().is_read); });
    std::swap(tasks, waiting_);
    writes_ = 0;
    return !stop_;
}

void Store::work(const std::deque<Task>& tasks) {
    const bool is_open = ensure_open();
    if (is_open)
        write(tasks);
    else
        settle(why_, 0, static_cast<std::size_t>(std::ranges::count(tasks, false, &Task::is_read)));
    for (const Task& task : tasks) {
        if (!task.is_read) continue;
        try {
            task.work(database_.get());
        } catch (const std::exception&) {
            task.work(nullptr);
        }
    }
    if (is_open) look_after();
}

bool Store::ensure_open() {
    if (database_) return true;
    if (pause_ > 0) {
        --pause_;
        return false;
    }
    try {
        database_ = std::make_unique<Database>(settings_);
        if (!database_->remark().empty()) tell_(false, database_->remark());
        settle("", 0, 0);
        seen_ = wall_();
        prune_at_ = std::max(prune_at_, seen_ + kPrune);
    } catch (const std::exception& error) {
        pause_ = kAgain;
        settle(error.what(), 0, 0);
    }
    return database_ != nullptr;
}

/// Carries out the writes in one transaction, and drops them if the disk refuses.
void Store::write(const std::deque<Task>& tasks) {
    const auto writes = static_cast<std::size_t>(std::ranges::count(tasks, false, &Task::is_read));
    if (writes == 0) return;
    try {
        database_->in_transaction([&] {
            for (const Task& task : tasks)
                if (!task.is_read) task.work(database_.get());
        });
        settle("", writes, 0);
    } catch (const SqlError& error) {
        settle(error.what(), 0, writes);
        prune_at_ = std::min(prune_at_, seen_);
        if (error.code() != SQLITE_FULL && error.code() != SQLITE_BUSY) database_.reset();
    }
}

/// Drops what is old, once an hour. A clock that has just been set by more than a day may be set
/// back: nothing is dropped for an hour.
void Store::look_after() {
    const WallTime now = wall_();
    if (std::chrono::abs(now - std::exchange(seen_, now)) > kStep) prune_at_ = now + kPrune;
    if (now < prune_at_ || !database_) return;
    prune_at_ = now + kPrune;
    try {
        database_->in_transaction([&] { database_->prune(now); });
    } catch (const SqlError& error) {
        settle(error.what(), 0, 0);
    }
}

/// Counts, and tells when the disk begins to refuse or to take writes.
void Store::settle(const std::string& why, std::size_t written, std::size_t lost) {
    bool turned = false;
    const std::uint64_t bytes = written > 0 ? database_->bytes() : 0;  // before others wait
    {
        const std::scoped_lock lock(mutex_);
        turned = counters_.failing != !why.empty();
        counters_.failing = !why.empty();
        counters_.written += written;
        counters_.lost += lost;
        if (turned && !why.empty()) ++counters_.failures;
        if (written > 0) counters_.bytes = bytes;
        why_ = why;
    }
    if (turned) tell_(!why.empty(), why);
}

}  // namespace panelgate::store
