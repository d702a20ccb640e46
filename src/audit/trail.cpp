#include "panelgate/audit/trail.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <condition_variable>
#include <csignal>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "panelgate/audit/record.hpp"
#include "writer.hpp"

namespace panelgate::audit {

namespace {

constexpr Duration kAgain = 1s;  // between two tries while the disk takes nothing, or two looks

/// Signals are for the loop's thread.
std::thread start_thread(std::function<void()> run) {
    sigset_t all{};
    sigset_t before{};
    ::sigfillset(&all);
    ::pthread_sigmask(SIG_SETMASK, &all, &before);
    std::thread thread(std::move(run));
    ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
    return thread;
}

/// The local syslog, in the format of RFC 5424. Never waits: what it does not take is lost there,
/// and counted.
class Syslog {
  public:
    explicit Syslog(std::string socket) : path_(std::move(socket)) {
        std::array<char, 256> name{};
        if (::gethostname(name.data(), name.size() - 1) == 0) host_ = name.data();
        if (host_.empty()) host_ = "-";
    }
    ~Syslog() { close(); }
    Syslog(const Syslog&) = delete;
    Syslog& operator=(const Syslog&) = delete;

    /// A record becomes `<110>1 TIME HOST panelgate PID KIND - {...}`: 110 is the facility "log
    /// audit" at level info. False: it was not taken.
    bool send(std::string_view line) {
        const auto record = parse_line(line);
        const std::string_view body = record ? record->body : std::string_view();
        text_ = "<110>1 ";
        text_ += member_of(body, "time");
        text_ += ' ' + host_ + " panelgate " + std::to_string(::getpid()) + ' ';
        text_ += member_of(body, "kind");
        text_ += " - ";
        text_ += line;
        if (socket_ < 0 && !connect()) return false;
        if (::send(socket_, text_.data(), text_.size(), MSG_DONTWAIT | MSG_NOSIGNAL) >= 0)
            return true;
        if (errno != EAGAIN && errno != ENOBUFS) close();  // it was restarted: the next one tries
        return false;
    }

  private:
    bool connect() {
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        if (path_.size() >= sizeof(address.sun_path)) return false;
        std::ranges::copy(path_, address.sun_path);
        socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
        const auto* where = reinterpret_cast<const sockaddr*>(&address);
        if (socket_ >= 0 && ::connect(socket_, where, sizeof(address)) == 0) return true;
        close();
        return false;
    }
    void close() {
        if (socket_ >= 0) ::close(socket_);
        socket_ = -1;
    }

    std::string path_;
    std::string host_;
    std::string text_;
    int socket_ = -1;
};

}  // namespace

struct Trail::State {
    State(const Settings& s, Hooks h, std::atomic<bool>& f)
        : settings(s),
          hooks(std::move(h)),
          failing(f),
          writer(s, hooks.wall, hooks.start,
                 [this](std::string_view line) {
                     if (settings.syslog && !syslog.send(line)) ++syslog_lost;
                 }),
          syslog(s.syslog_socket) {
        pending.reserve(std::min<std::size_t>(settings.buffer, 64 * 1024));
    }

    void run();
    void round(std::unique_lock<std::mutex>& lock);
    bool wait(std::unique_lock<std::mutex>& lock);
    void take_over();
    void work();
    void anchor();
    void publish();

    // Shared, under `mutex`.
    std::mutex mutex;
    std::condition_variable wake;
    Settings settings;
    std::optional<Settings> next;
    std::string pending;
    std::size_t of_last = 0;      ///< bytes of `pending` from before `next` was wanted
    std::uint64_t lost = 0;       ///< not yet recorded
    std::uint64_t told_lost = 0;  ///< in a record that is not yet written
    Counters counters;
    bool stop = false;

    // Of the thread.
    Hooks hooks;
    std::atomic<bool>& failing;
    Writer writer;
    Syslog syslog;
    std::uint64_t syslog_lost = 0;
    Composer composer;
    std::string taken;
    std::uint64_t failures = 0;
    std::uint64_t anchored = 0;
    WallTime anchored_at{};
    std::thread thread;
};

/// Waits until there is something to do, and then a little for more. True: that was the last time.
bool Trail::State::wait(std::unique_lock<std::mutex>& lock) {
    if (failing) {
        wake.wait_for(lock, kAgain, [&] { return stop; });
        return stop;
    }
    // A file that was removed is seen even when there is nothing to record.
    if (!wake.wait_for(lock, kAgain, [&] { return stop || next || !pending.empty(); }))
        return false;
    wake.wait_for(lock, settings.flush,
                  [&] { return stop || next || pending.size() > settings.buffer / 2; });
    return stop;
}

/// Call with the lock. What was added before another file was wanted belongs to the one before, if
/// that takes it.
void Trail::State::take_over() {
    const bool is_drained = of_last == 0 && writer.idle();
    if (next && (is_drained || failing || next->file == settings.file)) {
        settings = *std::exchange(next, std::nullopt);
        writer.apply(settings);
        anchored = 0;
        of_last = 0;
    }
    if (!writer.idle()) return;
    if (next) {
        taken.assign(pending, 0, of_last);
        pending.erase(0, std::exchange(of_last, 0));
        return;
    }
    const std::uint64_t left_out = std::exchange(lost, 0);
    std::swap(taken, pending);
    if (left_out == 0) return;
    told_lost = left_out;
    composer.begin(hooks.wall(), Kind::lost).number("count", left_out);
    taken += composer.body();
    taken += '\n';
}

void Trail::State::anchor() {
    const Position& last = writer.last();
    if (last.number == 0 || last.number == anchored) return;
    const WallTime time = hooks.wall();
    const bool due = anchored == 0 || last.number - anchored >= settings.anchor_every ||
                     time - anchored_at >= settings.anchor_after || time < anchored_at;
    if (!due) return;
    anchored = last.number;
    anchored_at = time;
    hooks.tell({Notice::Kind::anchor, writer.chain_id(), last});
}

void Trail::State::work() {
    bool good = false;
    std::string why;
    try {
        if (!taken.empty()) writer.take(taken);
        taken.clear();
        good = writer.work();
        if (!good) why = writer.why();
    } catch (const std::exception& error) {
        why = error.what();
    }
    if (auto remark = writer.remark(); !remark.empty())
        hooks.tell({Notice::Kind::remark, std::move(remark), {}});
    if (good != !failing) {
        failing = !good;
        hooks.tell({good ? Notice::Kind::recovered : Notice::Kind::failing, why, {}});
        if (!good) ++failures;
    }
    if (good) told_lost = 0;
    if (good) anchor();
}

void Trail::State::publish() {
    counters.records = writer.records();
    counters.rotations = writer.rotations();
    counters.failures = failures;
    counters.syslog_lost = syslog_lost;
    counters.failing = failing;
}

/// Takes what waits, and writes it without the lock.
void Trail::State::round(std::unique_lock<std::mutex>& lock) {
    take_over();
    lock.unlock();
    work();
    lock.lock();
    publish();
}

void Trail::State::run() {
    bool last = false;
    std::unique_lock lock(mutex);
    while (!last) {
        last = writer.last().number > 0 || failing ? wait(lock) : stop;
        round(lock);
    }
    // What came while the last try was going on, and what belongs to another file.
    for (int i = 0; i < 2; ++i) round(lock);
}

Trail::Trail(const Settings& settings, Hooks hooks)
    : state_(std::make_unique<State>(settings, std::move(hooks), failing_)) {
    state_->thread = start_thread([state = state_.get()] { state->run(); });
}

Trail::~Trail() { close(); }

Trail::End Trail::close() {
    if (state_->thread.joinable()) {
        {
            const std::scoped_lock lock(state_->mutex);
            state_->stop = true;
        }
        state_->wake.notify_one();
        state_->thread.join();
    }
    // What the thread had taken, what it had not, and what was counted only.
    const auto lines = [](const std::string& text) {
        return static_cast<std::uint64_t>(std::count(text.begin(), text.end(), '\n'));
    };
    Writer& writer = state_->writer;
    const std::uint64_t told = state_->told_lost;  // by one of the records
    return {writer.last(), writer.chain_id(),
            writer.unwritten() + lines(state_->taken) + lines(state_->pending) + state_->lost +
                told - (told > 0 ? 1 : 0)};
}

void Trail::add(std::string_view body) {
    State& state = *state_;
    bool wakes = false;
    {
        const std::scoped_lock lock(state.mutex);
        if (state.pending.size() + body.size() >= state.settings.buffer) {
            ++state.lost;
            ++state.counters.lost;
            return;
        }
        const std::size_t before = state.pending.size();
        state.pending += body;
        state.pending += '\n';
        const std::size_t half = state.settings.buffer / 2;
        wakes = before == 0 || (before <= half && state.pending.size() > half);
    }
    if (wakes) state.wake.notify_one();
}

void Trail::apply(const Settings& settings) {
    {
        const std::scoped_lock lock(state_->mutex);
        if (settings == state_->settings && !state_->next) return;
        if (!state_->next) state_->of_last = state_->pending.size();
        state_->next = settings;
    }
    state_->wake.notify_one();
}

Counters Trail::counters() const {
    const std::scoped_lock lock(state_->mutex);
    Counters counters = state_->counters;
    counters.waiting_bytes = state_->pending.size();
    return counters;
}

}  // namespace panelgate::audit
