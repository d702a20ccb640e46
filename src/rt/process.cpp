#include "panelgate/rt/process.hpp"

#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <unistd.h>
#include <algorithm>
#include <boost/asio/execution/outstanding_work.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/prefer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <cerrno>
#include <charconv>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <numeric>
#include <utility>

#include "panelgate/rt/log.hpp"

namespace panelgate::rt {

namespace asio = boost::asio;

struct Worker::Pool {
    asio::thread_pool threads{1};
};

Worker::Worker(asio::any_io_executor executor)
    : executor_(std::move(executor)), pool_(std::make_unique<Pool>()) {}

Worker::~Worker() {
    pool_->threads.stop();
    pool_->threads.join();
}

void Worker::run(std::function<void()> work, std::function<void()> done) {
    auto loop = asio::prefer(executor_, asio::execution::outstanding_work.tracked);
    asio::post(pool_->threads, [loop, work = std::move(work), done = std::move(done)]() mutable {
        work();
        work = nullptr;  // destroys its captures in this thread
        asio::post(loop, std::move(done));
    });
}

std::size_t raise_descriptor_limit() {
    rlimit limit{};
    if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return std::numeric_limits<std::size_t>::max();
    const rlimit raised{limit.rlim_max, limit.rlim_max};
    if (::setrlimit(RLIMIT_NOFILE, &raised) == 0) limit = raised;
    return limit.rlim_cur;
}

std::vector<std::size_t> share_descriptors(std::size_t available,
                                           const std::vector<std::size_t>& asked) {
    const std::size_t sum = std::accumulate(asked.begin(), asked.end(), std::size_t{0});
    if (sum <= available) return asked;
    const double part = static_cast<double>(available) / static_cast<double>(sum);
    std::vector<std::size_t> granted;
    for (const std::size_t wish : asked) {
        const auto share = static_cast<std::size_t>(static_cast<double>(wish) * part);
        granted.push_back(std::max(share, std::size_t{1}));
    }
    return granted;
}

namespace {

/// A thread that asks for short slices runs before compute-bound programs (Linux 6.12 and later;
/// earlier kernels ignore it). No privilege is needed.
void ask_for_short_slices() {
    constexpr unsigned kSlice = 100'000;  // ns, the shortest that Linux takes
    SchedAttr attributes;
    if (::syscall(SYS_sched_getattr, 0, &attributes, sizeof attributes, 0) != 0) return;
    if (attributes.policy != SCHED_OTHER) return;
    attributes.runtime = kSlice;
    ::syscall(SYS_sched_setattr, 0, &attributes, 0);
}

}  // namespace

std::vector<std::string> be_punctual(const RealtimeSettings& settings) {
    std::vector<std::string> refused;
    ::prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
    ask_for_short_slices();
    if (settings.priority > 0) {
        const sched_param parameter{.sched_priority = settings.priority};
        // Its child threads must not compete with it.
        if (::sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameter) != 0) {
            refused.push_back("realtime.priority " + std::to_string(settings.priority) + ": " +
                              std::strerror(errno) +
                              "; it takes CAP_SYS_NICE (docker run --cap-add SYS_NICE) or "
                              "LimitRTPRIO in the unit");
        }
    }
    if (settings.lock_memory && ::mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
        refused.push_back(std::string("realtime.lock_memory: ") + std::strerror(errno) +
                          "; it takes CAP_IPC_LOCK (docker run --cap-add IPC_LOCK) or "
                          "LimitMEMLOCK=infinity in the unit");
    }
    return refused;
}

void LoopLag::start() { arm(clock_.now() + kEvery); }

void LoopLag::arm(TimePoint due) {
    alarm_->arm(due, [this, due] {
        const TimePoint now = clock_.now();
        seconds_.observe(now - due);
        arm(now + kEvery);
    });
}

namespace {

std::string variable(const char* name) {
    const char* text = std::getenv(name);
    return text == nullptr ? "" : text;
}

/// Parses a whole number above 0.
std::optional<std::int64_t> number_of(std::string_view text) {
    std::int64_t value = 0;
    const auto [end, wrong] = std::from_chars(text.data(), text.data() + text.size(), value);
    const bool whole = wrong == std::errc{} && end == text.data() + text.size();
    return whole && value > 0 ? std::optional(value) : std::nullopt;
}

/// Returns the bytes of the sockaddr_un; empty for an unsupported name (unix(7)).
std::string address_of(std::string name) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const bool known = name.size() > 1 && (name[0] == '/' || name[0] == '@');
    if (!known || name.size() >= sizeof(address.sun_path)) return {};
    if (name[0] == '@') name[0] = '\0';
    std::ranges::copy(name, address.sun_path);
    std::string bytes(offsetof(sockaddr_un, sun_path) + name.size(), '\0');
    std::memcpy(bytes.data(), &address, bytes.size());
    return bytes;
}

std::int64_t microseconds(Duration duration) {
    return std::chrono::duration_cast<std::chrono::microseconds>(duration).count();
}

}  // namespace

ServiceEnvironment service_environment() {
    return {variable("NOTIFY_SOCKET"), variable("WATCHDOG_USEC"), variable("WATCHDOG_PID")};
}

std::optional<Duration> watchdog_interval(const ServiceEnvironment& environment,
                                          std::int64_t own_pid) {
    const auto waits = number_of(environment.watchdog_usec);
    const bool ours =
        environment.watchdog_pid.empty() || number_of(environment.watchdog_pid) == own_pid;
    if (!waits || !ours) return std::nullopt;
    return std::chrono::microseconds(std::max<std::int64_t>(*waits / 2, 1));
}

ServiceManager::ServiceManager(Clock& clock, const ServiceEnvironment& environment)
    : clock_(clock),
      again_(clock.make_alarm()),
      look_(clock.make_alarm()),
      watchdog_(clock.make_alarm()),
      feed_interval_(watchdog_interval(environment, ::getpid())),
      address_(address_of(environment.notify_socket)) {
    if (environment.notify_socket.empty()) return;
    if (!address_.empty()) socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (socket_ < 0) {
        log(LogLevel::warn, "service manager not notified",
            {{"socket", environment.notify_socket}, {"why", "no socket that can be sent to"}});
        return;
    }
    if (feed_interval_) feed_watchdog();
}

ServiceManager::~ServiceManager() {
    if (socket_ >= 0) ::close(socket_);
}

ServiceManager::Sent ServiceManager::send(std::string_view message) {
    const auto sent = ::sendto(socket_, message.data(), message.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
                               reinterpret_cast<const sockaddr*>(address_.data()),
                               static_cast<socklen_t>(address_.size()));
    if (sent >= 0) return Sent::taken;
    if (errno == EAGAIN || errno == EINTR || errno == ENOBUFS) return Sent::not_now;
    log(LogLevel::warn, "service manager not notified", {{"why", std::strerror(errno)}});
    return Sent::never;
}

/// Queues a message; the oldest is dropped from a full queue, as outdated.
void ServiceManager::say(std::string message) {
    if (socket_ < 0) return;
    if (waiting_.size() == kWaiting) waiting_.pop_front();
    waiting_.push_back(std::move(message));
    hand_over();
}

void ServiceManager::hand_over() {
    while (!waiting_.empty()) {
        if (send(waiting_.front()) == Sent::not_now) {
            again_->arm(clock_.now() + kAgain, [this] { hand_over(); });
            return;
        }
        waiting_.pop_front();
    }
}

void ServiceManager::ready(std::function<std::string()> status) {
    status_ = std::move(status);
    ready();
}

void ServiceManager::ready() {
    if (socket_ < 0) return;
    told_ = status_line();
    say("READY=1\n" + told_);
    look_->arm(clock_.now() + kLook, [this] { look(); });
}

void ServiceManager::reloading() {
    const Duration now = clock_.now().time_since_epoch();
    say("RELOADING=1\nMONOTONIC_USEC=" + std::to_string(microseconds(now)));
}

void ServiceManager::stopping(Duration patience) {
    look_->cancel();
    const std::string most = std::to_string(microseconds(patience));
    say("STOPPING=1\nSTATUS=answering what is in flight\nEXTEND_TIMEOUT_USEC=" + most);
}

std::string ServiceManager::status_line() const {
    std::string line = "STATUS=" + (status_ ? status_() : "");
    std::ranges::replace(line, '\n', ' ');
    return line;
}

void ServiceManager::look() {
    look_->arm(clock_.now() + kLook, [this] { look(); });
    if (!waiting_.empty()) return;
    std::string line = status_line();
    if (line != told_ && send(line) == Sent::taken) told_ = std::move(line);
}

void ServiceManager::feed_watchdog() {
    const bool later = send("WATCHDOG=1") == Sent::not_now;
    watchdog_->arm(clock_.now() + (later ? std::min(kAgain, *feed_interval_) : *feed_interval_),
                   [this] { feed_watchdog(); });
}

}  // namespace panelgate::rt
