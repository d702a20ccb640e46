#include "panelgate/web/http/crossing.hpp"

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
    const auto caller = std::make_shared<Caller>(client->stand_in());
    const auto question = std::make_shared<Awaited>(loops_.faces);
    client->at_leaving(question.get(), [self = shared_from_this(), caller, question] {
        self->tell([caller] { caller->leave(); });
        question->bell.cancel();
    });
    request.caller = caller;
    const auto asked = std::make_shared<HttpRequest>(std::move(request));
    queue(probe ? HostKey() : client->host(),
          [this, asked, handler = std::make_shared<const Handler>(std::move(handler)),
           waiting = std::weak_ptr(question)] { begin(std::move(*asked), handler, waiting); });
    pass_next();
    Handling waiting = wait_for(question, client);
    HttpResponse response = co_await std::move(waiting);
    client->forget(question.get());
    co_return response;
}

void Crossing::queue(const HostKey& host, std::function<void()> beginning) {
    Beginnings& own = waiting_[host];
    const bool is_probe = host == HostKey();
    if (own.empty() && is_probe) turns_.push_front(host);
    if (own.empty() && !is_probe) turns_.push_back(host);
    own.push_back(std::move(beginning));
}

std::function<void()> Crossing::take_next() {
    const HostKey host = std::move(turns_.front());
    turns_.pop_front();
    Beginnings& own = waiting_[host];
    std::function<void()> next = std::move(own.front());
    own.pop_front();
    if (own.empty())
        waiting_.erase(host);
    else if (host == HostKey())
        turns_.push_front(host);
    else
        turns_.push_back(host);
    return next;
}

/// Gives the plant the next request, unless the plant has not begun the last one yet.
void Crossing::pass_next() {
    if (passing_ || turns_.empty()) return;
    passing_ = true;
    tell([self = shared_from_this(), begin_next = take_next()] {
        const TimePoint began = rt::AsioClock::read();
        begin_next();
        const Duration took = rt::AsioClock::read() - began;
        asio::post(self->loops_.faces, [self, took] { self->rest(took); });
    });
}

/// Leaves the plant to its lines for a multiple of what the last request took.
void Crossing::rest(Duration took) {
    constexpr int kRest = 9;  // so that requests have a tenth of the plant's time at most
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
    const auto work = [making, finish = std::move(finish)] {
        try {
            finish(*making);
        } catch (const std::exception&) {  // no memory
            *making = to_response(problem(500, "the gateway failed to make this text"));
        }
    };
    worker->run(work, [making, awaited] { awaited->give(std::move(*making)); });
    Handling waiting = wait_for(awaited, std::move(caller));
    co_return co_await std::move(waiting);
}

}  // namespace panelgate::web
