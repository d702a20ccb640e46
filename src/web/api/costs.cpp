#include "costs.hpp"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace panelgate::web {
namespace {

constexpr std::size_t kLongest = 4000;  ///< characters: clients take 8,192 of a header

std::string name_of(const void* line, const Directory& directory) {
    for (const LineEntry& entry : directory.lines) {
        if (entry.bus == line) return entry.name + ':';
    }
    return {};
}

bool of_one_line(const std::vector<Caller::Cost>& costs) {
    return std::ranges::all_of(
        costs, [&](const Caller::Cost& cost) { return cost.line == costs.front().line; });
}

/// What several parts of a request had in common stands there once.
std::string text_of(const std::vector<Caller::Cost>& costs, const Directory& directory) {
    const bool plain = of_one_line(costs);
    std::string text;
    for (auto cost = costs.begin(); cost != costs.end(); ++cost) {
        if (std::find(costs.begin(), cost, *cost) != cost) continue;
        const std::string one = (plain ? std::string() : name_of(cost->line, directory)) +
                                std::to_string(cost->transaction);
        if (text.size() + one.size() + 2 > kLongest) break;
        if (!text.empty()) text += ", ";
        text += one;
    }
    return text;
}

}  // namespace

Handling costed(HttpRequest request, const Api* api, Handler handler) {
    const std::shared_ptr<Caller> caller = request.caller;
    caller->take_costs();
    Handling work = handler(std::move(request), api);
    HttpResponse response = co_await std::move(work);
    if (caller->has_left()) co_return response;
    const std::vector<Caller::Cost> costs = caller->take_costs();
    if (!costs.empty())
        response.headers.emplace_back("Panelgate-Transactions", text_of(costs, *api->directory));
    co_return response;
}

}  // namespace panelgate::web
