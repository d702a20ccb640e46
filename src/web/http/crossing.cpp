#include "panelgate/web/http/crossing.hpp"

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <exception>
#include <optional>
#include <string>
#include <utility>

#include "panelgate/rt/asio_clock.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/rt/loop.hpp"
#include "panelgate/rt/process.hpp"
#include "panelgate/web/http/problem.hpp"

namespace panelgate::web {

namespace asio = boost::asio;

/// A response that is made elsewhere while a session waits in the loop of the faces, which alone
/// uses all of this.
struct Crossing::Awaited {
    explicit Awaited(const asio::any_io_executor& faces) : bell(faces) {
        bell.expires_at(asio::steady_timer::time_point::max());
    }
    void give(HttpResponse made) {
        response = std::move(made);
        bell.cancel();
    }

    asio::steady_timer bell;
    std::optional<HttpResponse> response;
};

/// Waits for the response; it is empty if the client leaves before.
Handling Crossing::wait_for(std::shared_ptr<Awaited> awaited, std::shared_ptr<Caller> client) {
    while (!awaited->response && !client->has_left()) {
        boost::system::error_code rung;
        co_await awaited->bell.async_wait(asio::redirect_error(asio::use_awaitable, rung));
    }
    if (!awaited->response) co_return HttpResponse();
    co_return std::move(*awaited->response);
}

Crossing::Crossing(Loops loops) : loops_(std::move(loops)) {}

Handling Crossing::ask(HttpRequest request, Handler handler, bool probe) {
    const std::shared_ptr<Caller> client = request.caller;
    if (client->has_left()) co_return HttpResponse();  // its reset came along with the request
    const auto caller = std::make_shared<Caller>(client->stand_in());
    const auto question = std::make_shared<Awaited>(loops_.faces);
    client->at_leaving(question.get(), [self = shared_from_this(), caller, question] {
        self->tell([caller] { caller->leave(); });
        question->bell.cancel();
    });
    request.caller = caller;
    const auto asked = std::make_shared<HttpRequest>(std::move(request));
    turns_.add(probe ? HostKey() : client->host(),
               [this, asked, handler = std::make_shared<const Handler>(std::move(handler)),
                waiting = std::weak_ptr(question)] { begin(std::move(*asked), handler, waiting); });
    pass_next();
    Handling waiting = wait_for(question, client);
    HttpResponse response = co_await std::move(waiting);
    client->forget(question.get());
    co_return response;
}

std::optional<Turns::Turn> Turns::take() {
    auto next = askers_.end();
    for (auto one = askers_.begin(); one != askers_.end(); ++one) {
        const Asker& asker = one->second;
        if (asker.waiting.empty() || asker.holds > 0) continue;
        if (next == askers_.end() || asker.paid < next->second.paid) next = one;
    }
    if (next == askers_.end()) return std::nullopt;
    Turn turn{next->first, std::move(next->second.waiting.front())};
    next->second.waiting.pop_front();
    return turn;
}

/// Who owes nothing and asks nothing is forgotten.
void Turns::charge(TimePoint now, const HostKey& host, Duration cost) {
    TimePoint& paid = askers_[host].paid;
    if (host != HostKey()) paid = std::max(paid, now) + cost;
    std::erase_if(askers_, [&](const auto& one) {
        return one.second.waiting.empty() && one.second.holds == 0 && one.second.paid <= now;
    });
}

/// Gives the plant the next request, unless the plant has not begun the last one yet.
void Crossing::pass_next() {
    if (passing_) return;
    auto next = turns_.take();
    if (!next) return;
    passing_ = true;
    tell([self = shared_from_this(), next = std::move(*next)] {
        const TimePoint began = rt::AsioClock::read();
        next.work();
        const Duration took = rt::AsioClock::read() - began;
        asio::post(self->loops_.faces, [self, host = next.host, took] { self->rest(host, took); });
    });
}

/// Leaves the plant to its lines for a multiple of what the last request took.
void Crossing::rest(const HostKey& host, Duration took) {
    constexpr int kRest = 9;  // so that requests have a tenth of the plant's time at most
    turns_.charge(rt::AsioClock::read(), host, (1 + kRest) * took);
    const auto pause = std::make_shared<asio::steady_timer>(loops_.faces, kRest * took);
    pause->async_wait([self = shared_from_this(), pause](const boost::system::error_code&) {
        self->passing_ = false;
        self->pass_next();
    });
}

void Crossing::tell(std::function<void()> work) { asio::post(loops_.plant, std::move(work)); }

namespace {

HttpResponse failure(const std::string& path, const std::exception_ptr& failed) {
    std::string what = "unknown";
    try {
        std::rethrow_exception(failed);
    } catch (const std::exception& error) {
        what = error.what();
    } catch (...) {  // the text above
    }
    rt::log(rt::LogLevel::error, "http handler failed", {{"path", path}, {"error", what}});
    return to_response(problem(500, "the gateway failed to handle this request"));
}

}  // namespace

void Crossing::begin(HttpRequest request, std::shared_ptr<const Handler> handler,
                     std::weak_ptr<Awaited> waiting) {
    if (closed_ || request.caller->has_left()) return;
    const std::string path = request.path.empty() ? "/" : request.path.front();
    const std::shared_ptr<Caller> caller = request.caller;
    callers_.insert(caller);
    asio::co_spawn(loops_.plant, (*handler)(std::move(request)),
                   [self = shared_from_this(), handler, caller, path, waiting = std::move(waiting)](
                       const std::exception_ptr& failed, HttpResponse response) {
                       self->callers_.erase(caller);
                       if (failed && caller->has_left()) return;
                       if (failed) response = failure(path, failed);
                       asio::post(self->loops_.faces,
                                  [waiting, response = std::move(response)]() mutable {
                                      if (const auto question = waiting.lock())
                                          question->give(std::move(response));
                                  });
                   });
}

void Crossing::run(std::function<void()> work) const {
    if (is_one_loop()) return work();
    asio::post(loops_.faces, std::move(work));
}

void Crossing::call(const std::function<void()>& work) const {
    rt::call(loops_.faces, loops_.plant, work);
}

void Crossing::close() {
    closed_ = true;
    for (const std::shared_ptr<Caller>& caller : std::exchange(callers_, {})) caller->leave();
}

Handling Crossing::made_by_worker(HttpResponse response, std::function<void(HttpResponse&)> finish,
                                  std::shared_ptr<Caller> caller, rt::Worker* worker) {
    const auto awaited = std::make_shared<Awaited>(co_await asio::this_coro::executor);
    const auto making = std::make_shared<HttpResponse>(std::move(response));
    const auto took = std::make_shared<Duration>();
    const auto work = [making, finish = std::move(finish), took] {
        const TimePoint began = rt::AsioClock::read();
        try {
            finish(*making);
        } catch (const std::exception&) {  // no memory
            *making = to_response(problem(500, "the gateway failed to make this text"));
        }
        *took = rt::AsioClock::read() - began;
    };
    const HostKey host = caller->host();
    turns_.hold(host);
    worker->run(work, [self = shared_from_this(), making, awaited, took, host] {
        awaited->give(std::move(*making));
        self->turns_.release(host);
        self->turns_.charge(rt::AsioClock::read(), host, *took);
        self->pass_next();
    });
    Handling waiting = wait_for(awaited, std::move(caller));
    co_return co_await std::move(waiting);
}

}  // namespace panelgate::web
