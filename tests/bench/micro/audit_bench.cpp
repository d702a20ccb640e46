// What a record of the audit costs: in the loop (composing, appending), and in all (hash, file).
#include <benchmark/benchmark.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>

#include "panelgate/audit/chain.hpp"
#include "panelgate/audit/record.hpp"
#include "panelgate/audit/trail.hpp"
#include "support/temp_dir.hpp"

namespace panelgate::audit {
namespace {

void compose(Composer& composer, std::uint64_t i) {
    const std::array<std::uint16_t, 1> values{static_cast<std::uint16_t>(i)};
    composer
        .begin(WallTime(std::chrono::microseconds(1'764'147'600'000'000 + i * 1000)), Kind::write)
        .text("face", "modbus_tcp")
        .text("client", "192.168.10.17:51234")
        .text("listener", "0.0.0.0:502")
        .text("line", "floor1")
        .text("station", "press")
        .text("at", "UW102")
        .number("function", 6)
        .text("table", "holding-registers")
        .number("address", 102)
        .numbers("values", values)
        .numbers("before", values)
        .text("outcome", "confirmed")
        .number("transaction", i);
}

void audit_compose(benchmark::State& state) {
    Composer composer;
    std::uint64_t i = 0;
    for (auto _ : state) {
        compose(composer, ++i);
        benchmark::DoNotOptimize(composer.body());
    }
}
BENCHMARK(audit_compose);

void audit_chain(benchmark::State& state) {
    Composer composer;
    compose(composer, 1);
    Chain chain;
    std::string out;
    for (auto _ : state) {
        out.clear();
        chain.append(out, composer.body());
    }
}
BENCHMARK(audit_chain);

/// All of it, thread and file included: look at the process' CPU.
void audit_record(benchmark::State& state) {
    const test::TempDir folder;
    Settings settings;
    settings.file = (folder.path() / "audit.jsonl").string();
    settings.buffer = 64 * 1024 * 1024;
    Trail trail(settings, {[](Notice) {}, [] { return WallTime(); }, ""});
    Composer composer;
    std::uint64_t i = 0;
    for (auto _ : state) {
        compose(composer, ++i);
        trail.add(composer.body());
    }
    trail.close();
}
BENCHMARK(audit_record)->MeasureProcessCPUTime()->Iterations(200'000);

}  // namespace
}  // namespace panelgate::audit
