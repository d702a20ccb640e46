#include "panelgate/rt/service_manager.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "panelgate/rt/log.hpp"

namespace panelgate::rt {
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
