#include "panelgate/rt/worker.hpp"

#include <boost/asio/execution/outstanding_work.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/prefer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <utility>

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

}  // namespace panelgate::rt
