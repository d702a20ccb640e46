// What a record of the audit costs: in the loop (composing, appending), and in all (hash, file).
#include <benchmark/benchmark.h>

#include <boost/json/array.hpp>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>

#include "panelgate/audit/chain.hpp"
#include "panelgate/audit/record.hpp"
#include "panelgate/audit/trail.hpp"
#include "support/temp_dir.hpp"

namespace panelgate::audit {
namespace {

Members compose(std::uint64_t i) {
    Members record =
        record_of("write", WallTime(std::chrono::microseconds(1'764'147'600'000'000 + i * 1000)));
    for (const auto& [key, text] :
         {std::pair{"face", "modbus_tcp"}, std::pair{"client", "192.168.10.17:51234"},
          std::pair{"listener", "0.0.0.0:502"}, std::pair{"line", "floor1"},
          std::pair{"station", "press"}, std::pair{"at", "UW102"},
          std::pair{"table", "holding-registers"}, std::pair{"outcome", "confirmed"}})
        add_text(record, key, text);
    record["values"] = boost::json::array{i % 0x10000};
    record["transaction"] = i;
    return record;
}

void audit_compose(benchmark::State& state) {
    std::uint64_t i = 0;
    for (auto _ : state) benchmark::DoNotOptimize(body_of(compose(++i)));
}
BENCHMARK(audit_compose);

void audit_chain(benchmark::State& state) {
    const std::string body = body_of(compose(1));
    Chain chain;
    std::string out;
    for (auto _ : state) {
        out.clear();
        chain.append(out, body);
    }
}
BENCHMARK(audit_chain);

/// All of it, thread and file included: look at the process' CPU.
void audit_record(benchmark::State& state) {
    const test::TempDir folder;
    Settings settings;
    settings.file = (folder.path() / "audit.jsonl").string();
    settings.buffer = 64 * 1024 * 1024;
    Trail trail(settings, {[](Notice) {}, [] { return WallTime(); }, {}});
    std::uint64_t i = 0;
    for (auto _ : state) trail.add(compose(++i));
    trail.close();
}
BENCHMARK(audit_record)->MeasureProcessCPUTime()->Iterations(200'000);

}  // namespace
}  // namespace panelgate::audit
