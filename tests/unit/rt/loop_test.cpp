#include "panelgate/rt/loop.hpp"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <future>
#include <thread>

#include "panelgate/rt/log.hpp"

namespace panelgate::rt {
namespace {

TEST(Loop, RunsInAThreadOfItsOwnAndIsWaitedFor) {
    boost::asio::io_context own;
    Loop loop(0);
    std::thread::id there;
    call(loop.get_executor(), own.get_executor(), [&] { there = std::this_thread::get_id(); });
    EXPECT_NE(there, std::thread::id());
    EXPECT_NE(there, std::this_thread::get_id());
    call(own.get_executor(), own.get_executor(), [&] { there = std::this_thread::get_id(); });
    EXPECT_EQ(there, std::this_thread::get_id()) << "one loop does not wait for itself";
}

TEST(Loop, EndsWithWorkLeft) {
    auto kept = std::make_shared<int>(1);
    {
        Loop loop(0);
        std::promise<void> begun;
        std::promise<void> may_end;
        boost::asio::post(loop.get_executor(), [&, ended = may_end.get_future().share()] {
            begun.set_value();
            ended.wait();
        });
        boost::asio::post(loop.get_executor(), [kept] {});
        begun.get_future().wait();
        may_end.set_value();
    }
    EXPECT_EQ(kept.use_count(), 1) << "what waited is dropped";
}

TEST(Loop, EveryThreadMayLog) {
    boost::asio::io_context own;
    const LogTap tap;
    Loop loop(0);
    boost::asio::post(loop.get_executor(), [] {
        for (int i = 0; i < 20; ++i) log(LogLevel::warn, "there", {{"n", std::to_string(i)}});
    });
    for (int i = 0; i < 20; ++i) log(LogLevel::warn, "here", {{"n", std::to_string(i)}});
    call(loop.get_executor(), own.get_executor(), [] {});
    EXPECT_EQ(tap.count("warn there"), 20U);
    EXPECT_EQ(tap.count("warn here"), 20U);
}

}  // namespace
}  // namespace panelgate::rt
