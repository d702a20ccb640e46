#include "panelgate/audit/trail.hpp"

#include <algorithm>
#include <exception>
#include <utility>

#include "panelgate/base/thread.hpp"

namespace panelgate::audit {

namespace {

constexpr Duration kAgain = 1s;  // between two tries while the disk takes nothing, or two looks
constexpr std::uint64_t kAnchorEvery = 10'000;  // records
constexpr Duration kAnchorAfter = 10min;        // the same in time, if there was a record

std::uint64_t lines_in(const std::string& text) {
    return static_cast<std::uint64_t>(std::ranges::count(text, '\n'));
}

}  // namespace

Trail::Trail(const Settings& settings, Hooks hooks)
    : settings_(settings), hooks_(std::move(hooks)), writer_(settings, hooks_.wall, hooks_.start) {
    thread_ = start_thread([this] { run(); });
}

Trail::~Trail() { close(); }

Trail::End Trail::close() {
    if (thread_.joinable()) {
        {
            const std::scoped_lock lock(mutex_);
            stop_ = true;
        }
        wake_.notify_one();
        thread_.join();
    }
    return {writer_.last(), writer_.chain_id(), lines_in(batch_) + lines_in(pending_) + lost_};
}

void Trail::add(const Members& record) {
    const std::string body = body_of(record) + '\n';
    bool wakes = false;
    {
        const std::scoped_lock lock(mutex_);
        if (pending_.size() + body.size() > settings_.buffer) {
            ++lost_;
            ++counters_.lost;
            return;
        }
        wakes = pending_.empty() || pending_.size() > settings_.buffer / 2;
        pending_ += body;
    }
    if (wakes) wake_.notify_one();
}

void Trail::apply(const Settings& settings) {
    const std::scoped_lock lock(mutex_);
    settings_ = settings;
}

Counters Trail::counters() const {
    const std::scoped_lock lock(mutex_);
    return counters_;
}

void Trail::run() {
    for (bool first = true, last = false; !last; first = false) {
        {
            std::unique_lock lock(mutex_);
            last = first ? stop_ : wait(lock);
            take_over();
        }
        work();
        if (!failing_) anchor();
    }
    if (failing_) return;
    {  // what came while the disk took nothing, and the count of what was lost
        const std::scoped_lock lock(mutex_);
        take_over();
    }
    work();
}

/// Waits until there is something to do, and then a little for more. True: that was the last time.
bool Trail::wait(std::unique_lock<std::mutex>& lock) {
    // A file that was removed is seen even when there is nothing to record.
    const bool some =
        wake_.wait_for(lock, kAgain, [&] { return stop_ || (!failing_ && !pending_.empty()); });
    if (some)
        wake_.wait_for(lock, settings_.flush,
                       [&] { return stop_ || pending_.size() > settings_.buffer / 2; });
    return stop_;
}

/// Call with the lock.
void Trail::take_over() {
    writer_.apply(settings_);
    if (!batch_.empty()) return;
    std::swap(batch_, pending_);
    if (lost_ == 0 || failing_) return;
    Members record = record_of("lost", hooks_.wall());
    record["count"] = std::exchange(lost_, 0);
    batch_ += body_of(record) + '\n';
}

/// Writes what was taken over, without the lock.
void Trail::work() {
    bool good = false;
    std::string why;
    try {
        good = writer_.write(batch_);
        why = writer_.why();
    } catch (const std::exception& error) {
        why = error.what();
    }
    if (auto remark = writer_.remark(); !remark.empty())
        hooks_.tell({Notice::Kind::remark, std::move(remark), {}});
    const bool turned = good == failing_;
    {
        const std::scoped_lock lock(mutex_);
        if (!good && !failing_) ++counters_.failures;
        failing_ = counters_.failing = !good;
        counters_.records = writer_.records();
        counters_.rotations = writer_.rotations();
    }
    if (turned) hooks_.tell({good ? Notice::Kind::recovered : Notice::Kind::failing, why, {}});
}

/// Names the last record from time to time: the first of the run, and then some of those that
/// follow.
void Trail::anchor() {
    const Position& last = writer_.last();
    const WallTime time = hooks_.wall();
    const bool due = anchored_ == 0 || last.number - anchored_ >= kAnchorEvery ||
                     time - anchored_at_ >= kAnchorAfter || time < anchored_at_;
    if (!due || last.number == anchored_) return;
    anchored_ = last.number;
    anchored_at_ = time;
    hooks_.tell({Notice::Kind::anchor, writer_.chain_id(), last});
}

}  // namespace panelgate::audit
