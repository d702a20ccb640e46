#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <memory>

namespace panelgate::rt {

/// A thread beside the loop for work that would hold it: what is pure and long, on values that
/// nobody else has. Jobs run one after the other. Belongs to the loop's thread.
class Worker {
  public:
    explicit Worker(boost::asio::any_io_executor executor);
    /// Waits for the job that runs; those that wait are forgotten.
    ~Worker();
    Worker(const Worker&) = delete;
    Worker& operator=(const Worker&) = delete;

    /// `work` runs in the thread and does not throw; then `done` from the loop, which goes on while
    /// it is owed. After the end of the worker `done` may still be called.
    void run(std::function<void()> work, std::function<void()> done);

  private:
    struct Pool;
    boost::asio::any_io_executor executor_;
    std::unique_ptr<Pool> pool_;
};

}  // namespace panelgate::rt
