#include "panelgate/rt/loop.hpp"

#include <sys/resource.h>
#include <unistd.h>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <future>
#include <thread>
#include <utility>

namespace panelgate::rt {

namespace asio = boost::asio;

struct Loop::Running {
    explicit Running(int niceness)
        : thread([this, niceness] {
              const auto self = static_cast<id_t>(::gettid());  // Linux: a thread has a niceness
              ::setpriority(PRIO_PROCESS, self, ::getpriority(PRIO_PROCESS, self) + niceness);
              io.run();
          }) {}

    asio::io_context io{1};
    asio::executor_work_guard<asio::io_context::executor_type> work{io.get_executor()};
    std::thread thread;
};

Loop::Loop(int niceness) : running_(std::make_unique<Running>(niceness)) {}

Loop::~Loop() {
    running_->io.stop();
    running_->thread.join();
}

asio::any_io_executor Loop::get_executor() const { return running_->io.get_executor(); }

void give_back(const asio::any_io_executor& owner, std::shared_ptr<const void> object) {
    asio::post(owner, [object = std::move(object)] {});
}

void call(const asio::any_io_executor& loop, const asio::any_io_executor& own,
          const std::function<void()>& work) {
    if (loop == own) return work();
    std::promise<void> ended;
    asio::post(loop, [&] {
        work();
        ended.set_value();
    });
    ended.get_future().wait();
}

}  // namespace panelgate::rt
