#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <memory>

namespace panelgate::rt {

/// An event loop with a thread of its own. Owned by the thread of another loop.
class Loop {
  public:
    /// Starts the thread. `niceness`: of the thread, added to the process's, 0 to 19 (nice(2)).
    explicit Loop(int niceness);
    /// Ends the thread after the handler that runs, and drops what waits.
    ~Loop();
    Loop(const Loop&) = delete;
    Loop& operator=(const Loop&) = delete;

    boost::asio::any_io_executor get_executor() const;

  private:
    struct Running;
    std::unique_ptr<Running> running_;
};

/// Runs `work` on `loop`, and returns when `work` has ended; at once if `loop` is `own`, the
/// caller's loop. `work` must not throw, and `loop` must never wait for `own`.
void call(const boost::asio::any_io_executor& loop, const boost::asio::any_io_executor& own,
          const std::function<void()>& work);

}  // namespace panelgate::rt
