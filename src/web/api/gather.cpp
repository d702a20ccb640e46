#include "gather.hpp"

#include <boost/asio/associated_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <cstddef>
#include <exception>
#include <memory>
#include <utility>

namespace panelgate::web {
namespace asio = boost::asio;
namespace {

template <class Handler>
struct Gathering {
    explicit Gathering(Handler with) : handler(std::move(with)) {}

    Handler handler;
    std::size_t open = 0;
    std::exception_ptr failed;
};

struct StartAll {
    template <class Handler>
    void operator()(Handler handler, std::vector<asio::awaitable<void>> all) const {
        const auto executor = asio::get_associated_executor(handler);
        auto gathering = std::make_shared<Gathering<Handler>>(std::move(handler));
        gathering->open = all.size();
        for (asio::awaitable<void>& one : all) {
            asio::co_spawn(
                executor, std::move(one), [gathering, executor](std::exception_ptr failed) {
                    if (!gathering->failed) gathering->failed = failed;
                    if (--gathering->open > 0) return;
                    asio::post(executor,
                               [gathering] { std::move(gathering->handler)(gathering->failed); });
                });
        }
    }
};

}  // namespace

asio::awaitable<void> gather(std::vector<asio::awaitable<void>> all) {
    if (all.empty()) co_return;
    asio::awaitable<void> pending =
        asio::async_initiate<const asio::use_awaitable_t<>, void(std::exception_ptr)>(
            StartAll{}, asio::use_awaitable, std::move(all));
    co_await std::move(pending);
}

}  // namespace panelgate::web
