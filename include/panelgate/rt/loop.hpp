#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <memory>
#include <utility>

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

/// Lets go of an object in a loop.
void give_back(const boost::asio::any_io_executor& owner, std::shared_ptr<const void> object);

/// An object of the loop `owner` for other threads: when the last of them lets go, the object ends
/// in its own loop.
template <class Object>
std::shared_ptr<const Object> lend(const boost::asio::any_io_executor& owner,
                                   std::shared_ptr<const Object> object) {
    const Object* const lent = object.get();
    return {lent, [owner, object = std::move(object)](const Object*) mutable {
                give_back(owner, std::move(object));
            }};
}

}  // namespace panelgate::rt
