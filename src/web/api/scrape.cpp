#include "scrape.hpp"

#include <boost/asio/associated_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <utility>

namespace panelgate::web {
namespace asio = boost::asio;
namespace {

/// Resumes the coroutine by post: a source must not find itself called again from inside its own
/// completion.
struct StartScrape {
    template <class Handler>
    void operator()(Handler handler, MetricsSource* source, std::uint64_t caller, bool gzip) const {
        auto shared = std::make_shared<Handler>(std::move(handler));
        source->scrape(caller, gzip, [shared](SharedText text) {
            const auto executor = asio::get_associated_executor(*shared);
            asio::post(executor, [shared, text = std::move(text)]() mutable {
                (std::move(*shared))(std::move(text));
            });
        });
    }
};

asio::awaitable<SharedText> start_scrape(MetricsSource* source, std::uint64_t caller, bool gzip) {
    return asio::async_initiate<const asio::use_awaitable_t<>, void(SharedText)>(
        StartScrape{}, asio::use_awaitable, source, caller, gzip);
}

}  // namespace

asio::awaitable<SharedText> scrape(std::shared_ptr<Caller> caller, MetricsSource* source,
                                   bool gzip) {
    SharedText text;
    if (caller->has_left()) co_return text;
    const std::uint64_t id = caller->id();
    caller->at_leaving(source, [source, id] { source->cancel(id); });
    asio::awaitable<SharedText> pending = start_scrape(source, id, gzip);
    text = co_await std::move(pending);
    co_return text;
}

}  // namespace panelgate::web
