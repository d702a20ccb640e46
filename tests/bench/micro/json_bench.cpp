// The text of an answer with so many points.
#include <benchmark/benchmark.h>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <cstdint>
#include <string>
#include <utility>

#include "panelgate/web/http/json_text.hpp"

namespace panelgate::web {
namespace {

void json(benchmark::State& state) {
    boost::json::array points;
    for (std::int64_t i = 0; i < state.range(0); ++i) {
        points.push_back(boost::json::object{{"name", "temperature" + std::to_string(i)},
                                             {"value", 0.1 * static_cast<double>(i)},
                                             {"unit", "celsius"},
                                             {"quality", "good"},
                                             {"age_ms", i}});
    }
    const boost::json::value body = boost::json::object{{"points", std::move(points)}};
    for (auto _ : state) benchmark::DoNotOptimize(json_text(body));
    state.SetComplexityN(state.range(0));
}
BENCHMARK(json)->Arg(1)->Arg(10)->Arg(1000)->Complexity();

}  // namespace
}  // namespace panelgate::web
