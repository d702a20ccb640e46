// What rules of access cost a request: none, and many that all speak of the client who asks.
#include <benchmark/benchmark.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "panelgate/access/line_rules.hpp"
#include "support/request.hpp"

namespace panelgate::access {
namespace {

/// Ranges that the request does not meet: each rule is looked at.
std::shared_ptr<const Settings> many(std::int64_t rules) {
    auto settings = std::make_shared<Settings>();
    for (std::int64_t i = 0; i < rules; ++i) {
        Rule rule{.name = "rule-" + std::to_string(i), .acts = {Act::read, Act::write}};
        rule.from = {{"10.0.0.0", 8}};
        rule.roles = {"operator"};
        if (i % 2 == 0) rule.stations = {{"floor1", static_cast<std::uint8_t>(1 + i % 32)}};
        rule.range = "drawn";
        rule.unlisted_items = modbus::Span{modbus::Table::holding_registers,
                                           static_cast<std::uint32_t>(1000 + 10 * i), 10};
        settings->rules.push_back(std::move(rule));
    }
    return settings;
}

void judge(benchmark::State& state) {
    const LineRules rules(many(state.range(0)), "floor1", {1, 2, 3});
    const WhoRef who = make_who({.face = Face::modbus_tcp,
                                 .address = "10.0.0.7",
                                 .listener = "0.0.0.0:502",
                                 .standing = Role::operator_});
    const auto request = test::request_of({3, 0, 100, 0, 10});
    for (auto _ : state) {
        const Verdict verdict = rules.judge(who, 1, request);
        if (!verdict.allowed) state.SkipWithError("denied");
    }
}
BENCHMARK(judge)->Arg(0)->Arg(10)->Arg(200)->Arg(1000);

}  // namespace
}  // namespace panelgate::access
