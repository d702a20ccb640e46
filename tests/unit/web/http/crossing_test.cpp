#include "panelgate/web/http/crossing.hpp"

#include <gmock/gmock.h>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>

#include "panelgate/rt/asio_clock.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/rt/loop.hpp"

namespace panelgate::web::crossing_test {
namespace {

namespace asio = boost::asio;

/// The plant's loop is the test's thread, the faces' has its own.
class CrossingTest : public testing::Test {
  protected:
    /// Asks as a session does; `answered` is called in the faces' loop.
    void ask(Crossing::Handler handler, std::function<void(HttpResponse)> done) {
        asio::post(
            faces.get_executor(), [this, handler = std::move(handler), done = std::move(done)] {
                HttpRequest request;
                request.path = {"here"};
                request.caller = client;
                asio::co_spawn(faces.get_executor(), crossing->ask(std::move(request), handler),
                               [done](const std::exception_ptr&, HttpResponse response) {
                                   done(std::move(response));
                               });
            });
    }
    /// Runs the plant until the faces have called it.
    void run_until_answered() {
        while (!*answered) plant.run_one_for(std::chrono::milliseconds(5));
    }
    void on_faces(const std::function<void()>& work) {
        rt::call(faces.get_executor(), plant.get_executor(), work);
    }

    asio::io_context plant{1};
    asio::executor_work_guard<asio::io_context::executor_type> open{plant.get_executor()};
    rt::Loop faces{0};
    std::shared_ptr<Crossing> crossing =
        std::make_shared<Crossing>(Loops{faces.get_executor(), plant.get_executor()});
    std::shared_ptr<Caller> client = std::make_shared<Caller>(7, "10.0.0.9");
    std::shared_ptr<std::atomic<bool>> answered = std::make_shared<std::atomic<bool>>(false);
    HttpResponse got;
};

TEST_F(CrossingTest, ARequestIsCarriedOutAtThePlantAndAnsweredAtTheFaces) {
    std::thread::id at_plant;
    std::thread::id at_faces;
    std::uint64_t id = 0;
    const auto handler = [&](HttpRequest request) -> Handling {
        at_plant = std::this_thread::get_id();
        id = request.caller->id();
        HttpResponse response;
        response.body = request.caller->name();
        co_return response;
    };
    ask(handler, [&](HttpResponse response) {
        at_faces = std::this_thread::get_id();
        got = std::move(response);
        *answered = true;
    });
    run_until_answered();
    on_faces([] {});
    EXPECT_EQ(at_plant, std::this_thread::get_id());
    EXPECT_NE(at_faces, at_plant);
    EXPECT_EQ(id, 7U);
    EXPECT_EQ(got.body, "http 10.0.0.9");
}

TEST_F(CrossingTest, AClientThatLeavesLeavesAtThePlantToo) {
    std::shared_ptr<Caller> there;
    const auto handler = [&](HttpRequest request) -> Handling {
        there = request.caller;
        asio::steady_timer never(co_await asio::this_coro::executor,
                                 asio::steady_timer::time_point::max());
        there->at_leaving(&there, [&never] { never.cancel(); });
        boost::system::error_code rung;
        co_await never.async_wait(asio::redirect_error(asio::use_awaitable, rung));
        co_return HttpResponse();
    };
    ask(handler, [&](HttpResponse) { *answered = true; });
    while (!there) plant.run_one_for(std::chrono::milliseconds(5));
    EXPECT_FALSE(there->has_left());
    on_faces([&] { client->leave(); });
    run_until_answered();
    while (!there->has_left()) plant.run_one_for(std::chrono::milliseconds(5));
    plant.run_for(std::chrono::milliseconds(0));
}

TEST_F(CrossingTest, AClientThatLeftBeforeAsksNothing) {
    bool asked = false;
    client->leave();
    ask(
        [&](HttpRequest) -> Handling {
            asked = true;
            co_return HttpResponse();
        },
        [&](HttpResponse) { *answered = true; });
    run_until_answered();
    plant.poll();
    EXPECT_FALSE(asked);
}

TEST_F(CrossingTest, AddressesTakeTurnsAndAProbeGoesFirst) {
    boost::asio::io_context both;
    const auto one = std::make_shared<Crossing>(Loops(both.get_executor()));
    std::string order;
    const auto begin = [&](const std::string& address, const std::string& name, bool probe) {
        HttpRequest request;
        request.caller = std::make_shared<Caller>(1, address);
        const auto handler = [&order, name](HttpRequest) -> Handling {
            order += name + ' ';
            co_return HttpResponse();
        };
        asio::co_spawn(both, one->ask(std::move(request), handler, probe),
                       [](const std::exception_ptr&, const HttpResponse&) {});
    };
    for (const char* name : {"a1", "a2", "a3"}) begin("10.0.0.1", name, false);
    begin("10.0.0.2", "b1", false);
    begin("10.0.0.1", "probe", true);
    both.run();
    EXPECT_EQ(order, "a1 probe b1 a2 a3 ") << "a1 was alone when it came";
}

TEST(TurnsTest, WhoHasCostMoreWaitsForWhoHasCostLess) {
    Turns turns;
    const TimePoint now = TimePoint() + 1s;
    const auto taken = [&] {
        const auto turn = turns.take();
        return turn ? turn->host.text() : "nobody";
    };
    for (const char* address : {"a", "a", "b", "b", "b", ""}) turns.add(HostKey(address), [] {});
    EXPECT_EQ(taken(), "") << "a probe";
    turns.charge(now, HostKey(""), 1s);
    EXPECT_EQ(taken(), "a");
    turns.charge(now, HostKey("a"), 100ms);
    for (const Duration cost : {30ms, 40ms, 50ms}) {
        EXPECT_EQ(taken(), "b") << "until it owes as much";
        turns.charge(now, HostKey("b"), cost);
    }
    turns.add(HostKey("b"), [] {});
    EXPECT_EQ(taken(), "a");
    EXPECT_EQ(taken(), "b");
    EXPECT_EQ(taken(), "nobody");
}

TEST(TurnsTest, ADebtIsPaidByTimeAndWhoIsOnHoldWaits) {
    Turns turns;
    const TimePoint now = TimePoint() + 1s;
    turns.charge(now, HostKey("a"), 100ms);
    turns.charge(now + 90ms, HostKey("b"), 20ms);
    turns.add(HostKey("b"), [] {});
    turns.add(HostKey("a"), [] {});
    turns.hold(HostKey("a"));
    EXPECT_EQ(turns.take()->host.text(), "b");
    EXPECT_FALSE(turns.take());
    turns.release(HostKey("a"));
    EXPECT_EQ(turns.take()->host.text(), "a");
    turns.charge(now + 1s, HostKey("a"), 0ms);  // both have paid long ago
    for (const char* address : {"b", "a"}) turns.add(HostKey(address), [] {});
    EXPECT_EQ(turns.take()->host.text(), "a");
}

TEST_F(CrossingTest, AnExceptionIsA500AndInTheLog) {
    const rt::LogTap tap;
    const auto handler = [](HttpRequest) -> Handling {
        throw std::runtime_error("out of it");
        co_return HttpResponse();
    };
    ask(handler, [&](HttpResponse response) {
        got = std::move(response);
        *answered = true;
    });
    run_until_answered();
    on_faces([] {});
    EXPECT_EQ(got.status, 500U);
    EXPECT_EQ(tap.count("http handler failed path=here error=\"out of it\""), 1U);
}

TEST_F(CrossingTest, AServerThatIsGoneAsksNothingMore) {
    bool asked = false;
    crossing->close();
    ask(
        [&](HttpRequest) -> Handling {
            asked = true;
            co_return HttpResponse();
        },
        [&](HttpResponse) { *answered = true; });
    on_faces([] {});
    plant.poll();
    EXPECT_FALSE(asked);
    EXPECT_FALSE(*answered);
    on_faces([&] { client->leave(); });
    run_until_answered();
}

TEST_F(CrossingTest, ARequestMayEndWithThePlantsLoopAfterThatOfTheFaces) {
    bool begun = false;
    const auto handler = [&](HttpRequest) -> Handling {
        const TimePoint slow_until = rt::AsioClock::read() + std::chrono::milliseconds(50);
        while (rt::AsioClock::read() < slow_until) {
        }
        begun = true;
        asio::steady_timer never(co_await asio::this_coro::executor,
                                 asio::steady_timer::time_point::max());
        co_await never.async_wait(asio::use_awaitable);
        co_return HttpResponse();
    };
    ask(handler, [](const HttpResponse&) {});
    while (!begun) plant.run_one_for(std::chrono::milliseconds(5));
    on_faces([] {});  // the rest of the plant goes on; AddressSanitizer looks at what its end does
    const std::weak_ptr<Crossing> held = crossing;
    crossing.reset();
    EXPECT_FALSE(held.expired()) << "by the coroutine in the plant's loop";
}

TEST_F(CrossingTest, WhatThePlantHasLentEndsThere) {
    std::thread::id ended;
    std::shared_ptr<const int> lent =
        crossing->lend(std::shared_ptr<const int>(new int(5), [&](const int* value) {
            ended = std::this_thread::get_id();
            delete value;
        }));
    on_faces([&] {
        EXPECT_EQ(*lent, 5);
        lent.reset();
    });
    EXPECT_EQ(ended, std::thread::id());
    plant.poll();
    EXPECT_EQ(ended, std::this_thread::get_id());
}

}  // namespace
}  // namespace panelgate::web::crossing_test
