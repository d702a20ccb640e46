// The plan of a station's polls, by how many points it has.
#include <benchmark/benchmark.h>

#include <cstdint>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/points/read_plan.hpp"

namespace panelgate::points {
namespace {

void plan(benchmark::State& state) {
    PlanLimits limits;
    for (TableLimits& table : limits.tables) table = {125, {{0, 0xFFFF}}};
    std::vector<Want> wants;
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(state.range(0)); ++i) {
        const modbus::Span span{modbus::Table::holding_registers, 7 * i % 30000, 1 + i % 2};
        wants.push_back({span, i % 3 == 0 ? Duration{5s} : Duration{1s}});
    }
    for (auto _ : state) benchmark::DoNotOptimize(plan_reads(wants, limits));
    state.SetComplexityN(state.range(0));
}
BENCHMARK(plan)->Arg(10)->Arg(100)->Arg(1000)->Complexity();

}  // namespace
}  // namespace panelgate::points
