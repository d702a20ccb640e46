#include "descriptor_line.hpp"

#include <sys/epoll.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <boost/asio/error.hpp>
#include <cerrno>
#include <cstring>
#include <utility>

namespace panelgate::line {

namespace asio = boost::asio;
using boost::system::error_code;

Readiness::Readiness(const asio::any_io_executor& executor, std::function<void()> ready)
    : epoll_(executor), ready_(std::move(ready)) {}

Readiness::~Readiness() { *alive_ = false; }

std::string Readiness::watch(int fd) {
    forget();
    if (!epoll_.is_open()) {
        const int set = ::epoll_create1(EPOLL_CLOEXEC);
        if (set < 0) return std::strerror(errno);
        error_code error;
        epoll_.assign(set, error);
        if (error) {
            ::close(set);
            return error.message();
        }
    }
    epoll_event event{};
    event.events = EPOLLIN;
    if (::epoll_ctl(epoll_.native_handle(), EPOLL_CTL_ADD, fd, &event) != 0)
        return errno == EPERM ? "" : std::strerror(errno);
    fd_ = fd;
    events_ = EPOLLIN;
    wait();
    return {};
}

void Readiness::forget() {
    if (fd_ < 0) return;
    ::epoll_ctl(epoll_.native_handle(), EPOLL_CTL_DEL, std::exchange(fd_, -1), nullptr);
}

void Readiness::end() {
    forget();
    error_code ignored;
    epoll_.close(ignored);
}

void Readiness::want_input(bool wanted) {
    want(wanted ? events_ | EPOLLIN : events_ & ~std::uint32_t{EPOLLIN});
}

void Readiness::want_output(bool wanted) {
    want(wanted ? events_ | EPOLLOUT : events_ & ~std::uint32_t{EPOLLOUT});
}

void Readiness::want(std::uint32_t events) {
    if (fd_ < 0 || events == events_) return;
    events_ = events;
    epoll_event event{};
    event.events = events;
    ::epoll_ctl(epoll_.native_handle(), EPOLL_CTL_MOD, fd_, &event);
    wait();
}

/// One wait at a time. Each one checks the set anew, so that earlier events are not missed.
void Readiness::wait() {
    if (waiting_) return;
    waiting_ = true;
    epoll_.async_wait(asio::posix::stream_descriptor::wait_read,
                      [this, alive = alive_](error_code error) {
                          if (!*alive) return;
                          waiting_ = false;
                          // A set that was closed meanwhile, and another one is watched.
                          const bool is_other = error == asio::error::operation_aborted;
                          if ((error && !is_other) || fd_ < 0) return;
                          ready_();
                          if (*alive && fd_ >= 0 && events_ != 0) wait();
                      });
}

namespace {

/// Bytes per second.
std::size_t rate_of(const Settings& settings) {
    const auto characters = settings.serial.baud / settings.serial.bits_per_character();
    return std::max<std::size_t>(settings.input_rate, static_cast<std::size_t>(4 * characters));
}

}  // namespace

DescriptorLine::DescriptorLine(const boost::asio::any_io_executor& executor, rt::Clock& clock,
                               Settings settings)
    : settings_(std::move(settings)),
      readiness_(executor, [this] { on_ready(); }),
      clock_(clock),
      next_opening_(clock.make_alarm()),
      next_reading_(clock.make_alarm()),
      budget_(rate_of(settings_)),
      reopen_(settings_.reopen_min, settings_.reopen_max) {}

void DescriptorLine::start(Events& events) {
    events_ = &events;
    alive_ = std::make_shared<bool>(true);
    begin_open();
}

void DescriptorLine::stop() {
    if (alive_) *alive_ = false;
    events_ = nullptr;
    next_opening_->cancel();
    next_reading_->cancel();
    cancel_open();
    close();
    readiness_.end();
}

void DescriptorLine::poll_input() {
    if (is_open()) read_all();
}

ssize_t DescriptorLine::get(std::span<std::uint8_t> room) {
    return ::read(fd_, room.data(), room.size());
}

ssize_t DescriptorLine::put(ByteView bytes) { return ::write(fd_, bytes.data(), bytes.size()); }

std::string DescriptorLine::adopt(int fd) {
    std::string error = readiness_.watch(fd);
    if (error.empty()) {
        fd_ = fd;
        throttled_ = false;
        next_reading_->cancel();
    } else {
        ::close(fd);
    }
    return error;
}

void DescriptorLine::open_at(TimePoint when) {
    next_opening_->arm(when, [this] {
        if (!is_open()) begin_open();
    });
}

void DescriptorLine::open_failed(const std::string& why) {
    close();
    if (events_ == nullptr) return;
    if (why != last_error_) events_->on_down(why);
    last_error_ = why;
    if (events_ != nullptr) retry_later();
}

void DescriptorLine::opened() {
    if (openings_++ > 0) ++counters_.reopens;
    last_error_.clear();
    has_received_ = has_sent_ = false;
    opened_at_ = clock_.now();
    events_->on_up();
}

void DescriptorLine::lost(const std::string& why) {
    if (is_open()) was_lost(has_sent_ && !has_received_);
    close();
    go_down(settings_.device + " is gone: " + why, has_received_ || may_have_returned());
}

void DescriptorLine::reset(const std::string& why) {
    if (!is_open()) return;
    close(true);
    go_down(settings_.device + " is opened anew: " + why, has_received_);
}

/// After an opening without a received byte it backs off as after a failure: the next may be as
/// useless.
void DescriptorLine::go_down(const std::string& why, bool retry_at_once) {
    last_error_ = why;
    if (events_ != nullptr) events_->on_down(why);
    if (events_ == nullptr) return;
    retry_later();
    if (retry_at_once) open_soon();
}

void DescriptorLine::retry_later() {
    waiting();
    open_at(clock_.now() + reopen_.next_pause());
}

/// A device that appears changes its folder several times (node, owner, link): one attempt per 20
/// ms is enough, and the last change must not be missed.
void DescriptorLine::open_soon() {
    if (events_ == nullptr || is_open()) return;
    constexpr Duration kPause = 20ms;
    const TimePoint now = clock_.now();
    const TimePoint when = std::max(now, next_try_);
    next_try_ = when + kPause;
    open_at(when);
}

/// Discards overdue bytes: no client waits for their reply any more.
void DescriptorLine::close(bool discard) {
    if (is_open()) close_device(discard || undelivered());
    unsent_.clear();
}

void DescriptorLine::close_device(bool) {
    readiness_.forget();
    ::close(std::exchange(fd_, -1));
}

void DescriptorLine::on_ready() {
    read_all();
    if (is_open() && !unsent_.empty()) flush();
}

void DescriptorLine::read_all() {
    std::array<std::uint8_t, 1024> buffer;
    constexpr int kMaxReads = 16;  // a babbling line must not block the others
    if (throttled_) return;
    const TimePoint now = clock_.now();
    for (int i = 0; i < kMaxReads; ++i) {
        if (!budget_.allows(now)) return pause_reading(budget_.next());
        const ssize_t n = get(buffer);
        if (n > 0) {
            budget_.spend(now, static_cast<std::size_t>(n));
            counters_.bytes_received += static_cast<std::uint64_t>(n);
            const bool is_answer = has_sent_ || now >= opened_at_ + settings_.reopen_max;
            if (is_answer && !std::exchange(has_received_, true)) reopen_.succeeded();
            events_->on_bytes(ByteView(buffer).first(static_cast<std::size_t>(n)));
            if (events_ == nullptr || !is_open()) return;
            if (static_cast<std::size_t>(n) < buffer.size()) return;
            continue;
        }
        if (n < 0 && (errno == EAGAIN || errno == EINTR)) return;
        lost(n == 0 ? "hang-up" : std::strerror(errno));
        return;
    }
}

void DescriptorLine::pause_reading(TimePoint until) {
    throttled_ = true;
    want_input();
    next_reading_->arm(until, [this] {
        throttled_ = false;
        want_input();
    });
}

void DescriptorLine::write(ByteView bytes) {
    if (!is_open()) return;
    if (undelivered()) return reset(blocked_reason());
    counters_.bytes_sent += bytes.size();
    budget_.on_sent();
    has_sent_ = true;
    unsent_.assign(bytes.begin(), bytes.end());
    flush();
}

void DescriptorLine::flush() {
    while (!unsent_.empty()) {
        const ssize_t n = put(unsent_);
        if (n > 0) {
            unsent_.erase(unsent_.begin(), unsent_.begin() + n);
            continue;
        }
        if (n < 0 && errno == EINTR) continue;
        if (n < 0 && errno == EAGAIN) break;
        lost(n == 0 ? "hang-up" : std::strerror(errno));
        return;
    }
    readiness_.want_output(!unsent_.empty());
}

}  // namespace panelgate::line
