#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace panelgate::line {

/// Says when a descriptor can be read or written, and can be told not to: an event loop's own watch
/// would wake for each byte, wanted or not. It stands between the two, as an epoll set of one.
/// Loss of the device is always said. One thread; the descriptor is its owner's.
class Readiness {
  public:
    /// `ready` is called from the loop: what it may read and write is then there, or was.
    Readiness(const boost::asio::any_io_executor& executor, std::function<void()> ready);
    ~Readiness();
    Readiness(const Readiness&) = delete;
    Readiness& operator=(const Readiness&) = delete;

    /// Watches for input from now on. An error text when it cannot; a plain file, which is always
    /// ready, is not watched.
    std::string watch(int fd);
    /// No longer: before the descriptor is closed.
    void forget();
    /// Does nothing while nothing is watched.
    void want_input(bool wanted);
    void want_output(bool wanted);

  private:
    void want(std::uint32_t events);
    void wait();

    boost::asio::posix::stream_descriptor epoll_;
    std::function<void()> ready_;
    int fd_ = -1;
    std::uint32_t events_ = 0;
    bool waiting_ = false;  ///< the loop watches the set
    std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace panelgate::line
