#include "long_answer.hpp"

#include <boost/asio/post.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <utility>

#include "panelgate/web/http/json_text.hpp"

namespace panelgate::web {
namespace json = boost::json;

/// Some 0.1 ms.
constexpr std::size_t kEntriesOfATurn = 16;

void LongAnswer::begin_member(std::string_view name) {
    if (!std::exchange(is_first_, false)) text_ += ',';
    text_ += json_text(json::value(name)) + ':';
}

LongAnswer& LongAnswer::begin_list(std::string_view name) {
    begin_member(name);
    text_ += '[';
    is_first_ = true;
    return *this;
}

void LongAnswer::add(const json::value& entry) {
    if (!std::exchange(is_first_, false)) text_ += ',';
    text_ += json_text(entry);
    ++entries_;
}

LongAnswer& LongAnswer::end_list() {
    text_ += ']';
    is_first_ = false;
    return *this;
}

LongAnswer& LongAnswer::member(std::string_view name, const json::value& value) {
    begin_member(name);
    text_ += json_text(value);
    return *this;
}

bool LongAnswer::is_turn_over() {
    if (entries_ < kEntriesOfATurn) return false;
    entries_ = 0;
    return true;
}

HttpResponse LongAnswer::response() {
    HttpResponse response;
    response.body = std::move(text_) + "}\n";
    return response;
}

boost::asio::awaitable<void> others_turn() {
    const auto executor = co_await boost::asio::this_coro::executor;
    co_await boost::asio::post(executor, boost::asio::use_awaitable);
}

}  // namespace panelgate::web
