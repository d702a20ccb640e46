#include "panelgate/rt/worker.hpp"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <future>
#include <thread>
#include <vector>

namespace panelgate::rt::worker_test {
namespace {

TEST(Worker, WorksInAnotherThreadAndIsDoneInTheLoop) {
    boost::asio::io_context io(1);
    Worker worker(io.get_executor());
    std::thread::id worked;
    std::thread::id done;
    worker.run([&] { worked = std::this_thread::get_id(); },
               [&] { done = std::this_thread::get_id(); });
    io.run();  // does not end before
    EXPECT_NE(worked, std::thread::id());
    EXPECT_NE(worked, std::this_thread::get_id());
    EXPECT_EQ(done, std::this_thread::get_id());
}

TEST(Worker, TakesOneJobAfterTheOther) {
    boost::asio::io_context io(1);
    Worker worker(io.get_executor());
    std::vector<int> order;
    for (int i = 0; i < 5; ++i) {
        worker.run([&order, i] { order.push_back(i); }, [] {});
    }
    io.run();
    EXPECT_EQ(order, (std::vector{0, 1, 2, 3, 4}));
}

TEST(Worker, ItsEndWaitsForTheJobThatRuns) {
    boost::asio::io_context io(1);
    std::promise<void> begun;
    std::promise<void> go_on;
    bool ended = false;
    std::jthread helper;
    {
        Worker worker(io.get_executor());
        worker.run(
            [&] {
                begun.set_value();
                go_on.get_future().wait();
                ended = true;
            },
            [] {});
        begun.get_future().wait();
        helper = std::jthread([&] { go_on.set_value(); });
    }
    EXPECT_TRUE(ended);
    io.run();
}

}  // namespace
}  // namespace panelgate::rt::worker_test
