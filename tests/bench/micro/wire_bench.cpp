// What every transaction does to bytes: CRC, frames in and out, Modbus/TCP headers.
#include <benchmark/benchmark.h>

#include <cstddef>
#include <cstdint>

#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/framing.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/modbus/rtu_framer.hpp"

namespace panelgate {
namespace {

constexpr std::uint8_t kStation = 7;

Bytes read_request(unsigned registers) { return Writer().u8(3).u16(100).u16(registers).take(); }

Bytes read_reply(unsigned registers) {
    Writer reply;
    reply.u8(3).u8(2 * registers);
    for (unsigned i = 0; i < registers; ++i) reply.u16(31 * i);
    return reply.take();
}

void crc(benchmark::State& state) {
    const Bytes frame(static_cast<std::size_t>(state.range(0)), 0x5A);
    for (auto _ : state) benchmark::DoNotOptimize(modbus::crc16(frame));
    state.SetBytesProcessed(state.iterations() * state.range(0));
}
BENCHMARK(crc)->Arg(8)->Arg(25)->Arg(205);

void encode_request(benchmark::State& state) {
    const Bytes request = read_request(10);
    for (auto _ : state) benchmark::DoNotOptimize(modbus::encode_adu(kStation, request));
}
BENCHMARK(encode_request);

/// The reply of so many registers, heard in pieces of so many bytes.
void reply_framer(benchmark::State& state) {
    const auto registers = static_cast<unsigned>(state.range(0));
    const auto piece = static_cast<std::size_t>(state.range(1));
    const Bytes request = read_request(registers);
    const Bytes heard = modbus::encode_adu(kStation, read_reply(registers));
    for (auto _ : state) {
        modbus::ReplyFramer framer(kStation, request);
        ByteView rest(heard);
        while (rest.size() > piece) {
            benchmark::DoNotOptimize(framer.feed(rest.first(piece)));
            rest = rest.subspan(piece);
        }
        auto reply = framer.feed(rest);
        if (!reply) state.SkipWithError("the reply was not found");
        benchmark::DoNotOptimize(reply);
    }
}
BENCHMARK(reply_framer)->Args({10, 1})->Args({10, 256})->Args({100, 1})->Args({100, 256});

void mbap_request(benchmark::State& state) {
    const Bytes adu = modbus::encode_mbap(1, kStation, read_request(10));
    modbus::MbapFramer framer;
    for (auto _ : state) {
        framer.feed(adu);
        benchmark::DoNotOptimize(framer.next());
        benchmark::DoNotOptimize(framer.next());
    }
}
BENCHMARK(mbap_request);

void mbap_reply(benchmark::State& state) {
    const Bytes reply = read_reply(static_cast<unsigned>(state.range(0)));
    for (auto _ : state) benchmark::DoNotOptimize(modbus::encode_mbap(1, kStation, reply));
}
BENCHMARK(mbap_reply)->Arg(10)->Arg(100);

}  // namespace
}  // namespace panelgate
