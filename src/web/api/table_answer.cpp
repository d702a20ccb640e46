#include "table_answer.hpp"

#include <boost/asio/awaitable.hpp>
#include <string>
#include <utility>

#include "csv.hpp"
#include "long_answer.hpp"

namespace panelgate::web {

Handling table_answer(HttpRequest request, Table table) {
    const bool as_csv = prefers_csv(request.headers["accept"]);
    LongAnswer body;
    for (const auto& [name, value] : table.members) body.member(name, value);
    std::string lines = csv_line(table.columns);
    body.begin_list(table.name);
    for (std::size_t i = 0; i < table.count; ++i) {
        const boost::json::object one = table.entry(i);
        if (as_csv) {
            lines += csv_line(one, table.columns);
            body.add(nullptr);  // counts turns
        } else {
            body.add(one);
        }
        if (!body.is_turn_over()) continue;
        boost::asio::awaitable<void> turn = others_turn();
        co_await std::move(turn);
        if (request.caller->has_left()) co_return HttpResponse{};
    }
    body.end_list();
    HttpResponse response = as_csv ? csv_response(std::move(lines)) : body.response();
    response.headers.emplace_back("Vary", "Accept");
    co_return response;
}

}  // namespace panelgate::web
