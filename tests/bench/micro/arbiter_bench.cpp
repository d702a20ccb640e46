// A line's turn: the queue, one transaction of the arbiter from request to answer, shared reads.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <variant>

#include "panelgate/arbiter/arbiter.hpp"
#include "panelgate/arbiter/queue/job_queue.hpp"
#include "panelgate/arbiter/queue/read_cache.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "support/request.hpp"

namespace panelgate::arbiter {
namespace {

constexpr unsigned kRegisters = 10;
constexpr std::uint8_t kStations = 8;

Bytes read_of(unsigned address) { return Writer().u8(3).u16(address).u16(kRegisters).take(); }

Job read_job(Ticket ticket, Client client) {
    return {.ticket = ticket,
            .station = static_cast<std::uint8_t>(1 + client % kStations),
            .request = test::request_of(read_of(static_cast<unsigned>(20 * client))),
            .client = client,
            .host = client};
}

/// One more comes and the next one goes, where so many clients wait.
void queue_turn(benchmark::State& state) {
    JobQueue queue{QueueSettings{}};
    Ticket ticket = 0;
    for (Client client = 1; client < static_cast<Client>(state.range(0)); ++client)
        queue.push(read_job(++ticket, client));
    const auto any = [](const Job& /*job*/) { return true; };
    Client client = static_cast<Client>(state.range(0));
    for (auto _ : state) {
        queue.push(read_job(++ticket, client));
        client = queue.take(queue.choose(any)).client;
    }
}
BENCHMARK(queue_turn)->Arg(1)->Arg(8)->Arg(64)->Arg(250);

Settings eight_stations() {
    Settings settings;
    settings.serial = {38400, 8, Parity::even, 1};
    for (std::uint8_t id = 1; id <= kStations; ++id) {
        StationSettings station;
        station.id = id;
        settings.stations.push_back(station);
    }
    return settings;
}

/// Panels that answer each request one millisecond after it has left.
class Line {
  public:
    Line() : arbiter_(eight_stations()) { arbiter_.on_line_up(now_); }

    void add(Client client) {
        const unsigned address = 20 * (++requests_ % 1000);
        (void)arbiter_.submit(now_, {.station = static_cast<std::uint8_t>(1 + client % kStations),
                                     .request = test::request_of(read_of(address)),
                                     .client = client,
                                     .host = client});
    }
    /// Until somebody is answered.
    bool run_one(std::size_t piece) {
        for (int step = 0; step < 20; ++step) {
            if (act()) return true;
            if (heard_.empty()) {
                now_ = arbiter_.next_deadline().value_or(now_ + 1ms);
                arbiter_.on_deadline(now_);
            } else {
                speak(piece);
            }
        }
        return false;
    }

  private:
    bool act() {
        bool answered = false;
        while (auto action = arbiter_.poll_action()) {
            if (const auto* sent = std::get_if<Transmit>(&*action)) {
                Writer reply;
                reply.u8(3).u8(2 * kRegisters);
                for (unsigned i = 0; i < kRegisters; ++i) reply.u16(requests_ + i);
                heard_ = modbus::encode_adu(sent->adu[0], std::move(reply).take());
            }
            answered = answered || std::holds_alternative<Finish>(*action);
        }
        return answered;
    }
    void speak(std::size_t piece) {
        now_ += 10ms;
        const Bytes said = std::exchange(heard_, {});
        for (ByteView rest(said); !rest.empty();) {
            const std::size_t count = std::min(piece, rest.size());
            arbiter_.on_rx(now_, rest.first(count));
            rest = rest.subspan(count);
        }
    }

    TimePoint now_{};
    Arbiter arbiter_;
    Bytes heard_;
    unsigned requests_ = 0;
};

/// So many clients, each of which asks again once answered; replies in pieces of so many bytes.
void arbiter_transaction(benchmark::State& state) {
    Line line;
    for (Client client = 1; client <= static_cast<Client>(state.range(0)); ++client)
        line.add(client);
    Client next = 0;
    for (auto _ : state) {
        if (!line.run_one(static_cast<std::size_t>(state.range(1))))
            state.SkipWithError("nobody was answered");
        line.add(1 + next++ % static_cast<Client>(state.range(0)));
    }
}
BENCHMARK(arbiter_transaction)->Args({1, 256})->Args({8, 256})->Args({250, 256})->Args({8, 1});

void slice_registers(benchmark::State& state) {
    const modbus::Span whole{modbus::Table::holding_registers, 100, 100};
    const modbus::Span part{modbus::Table::holding_registers, 140, 10};
    const Bytes reply(202, 3);
    for (auto _ : state) benchmark::DoNotOptimize(slice_reply(whole, reply, part));
}
BENCHMARK(slice_registers);

void slice_bits(benchmark::State& state) {
    const modbus::Span whole{modbus::Table::coils, 100, 1000};
    const modbus::Span part{modbus::Table::coils, 203, 100};
    const Bytes reply(127, 1);
    for (auto _ : state) benchmark::DoNotOptimize(slice_reply(whole, reply, part));
}
BENCHMARK(slice_bits);

}  // namespace
}  // namespace panelgate::arbiter
