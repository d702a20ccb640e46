#include "panelgate/rt/loop.hpp"

#include <sys/syscall.h>
#include <unistd.h>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <future>
#include <thread>
#include <utility>

#include "panelgate/rt/process.hpp"

namespace panelgate::rt {

namespace asio = boost::asio;

namespace {

/// Of the calling thread. sched_setattr(2) is among the calls that the service's unit allows.
void be_nicer(int by) {
    SchedAttr attributes;
    if (::syscall(SYS_sched_getattr, 0, &attributes, sizeof attributes, 0) != 0) return;
    attributes.nice += by;
    ::syscall(SYS_sched_setattr, 0, &attributes, 0);
}

}  // namespace

struct Loop::Running {
    explicit Running(int niceness)
        : thread([this, niceness] {
              be_nicer(niceness);
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
