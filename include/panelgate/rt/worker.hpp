#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <memory>

namespace panelgate::rt {

/// A thread for long, pure computations that would block the loop, on values no other thread uses.
/// Jobs run one after the other. Owned by the loop's thread.
class Worker {
  public:
    explicit Worker(boost::asio::any_io_executor executor);
    /// Waits for the running job; drops queued ones.
    ~Worker();
    Worker(const Worker&) = delete;
    Worker& operator=(const Worker&) = delete;

    /// Runs `work` in the thread (it must not throw), then `done` from the loop, which keeps
    /// running until then. `done` may still be called after the worker's end.
    void run(std::function<void()> work, std::function<void()> done);

  private:
    struct Pool;
    boost::asio::any_io_executor executor_;
    std::unique_ptr<Pool> pool_;
};

}  // namespace panelgate::rt
