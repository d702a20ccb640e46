#pragma once

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/bus/bus.hpp"
#include "support/hex.hpp"
#include "support/manual_clock.hpp"
#include "support/memory_line.hpp"
#include "support/request.hpp"

namespace panelgate::bus {

inline const Bytes kRead = "03 00 6B 00 03"_hex;
inline const Bytes kReply = "03 06 02 2B 00 00 00 64"_hex;
inline const Bytes kWrite = "06 00 01 00 03"_hex;

/// A bus at 1 Mbit/s with press 17 on a line in memory that answers every read alike.
class BusCase : public testing::Test {
  protected:
    BusCase() {
        settings.name = "floor1";
        settings.arbiter.serial = {1000000, 8, Parity::none, 1};
        settings.arbiter.unlisted.response_timeout = 5ms;
        settings.stations[17].name = "press";
        settings.doctor.rest = {};
        list({17});
    }
    /// What observes the bus may be a test's own.
    void TearDown() override { bus.reset(); }
    /// These stations have the settings of unlisted ones.
    void list(std::initializer_list<std::uint8_t> ids) {
        settings.arbiter.stations.clear();
        for (const std::uint8_t id : ids) {
            settings.arbiter.stations.push_back(settings.arbiter.unlisted);
            settings.arbiter.stations.back().id = id;
        }
    }
    void make_bus() {
        auto memory = std::make_unique<test::MemoryLine>(clock);
        line = memory.get();
        line->reply = kReply;
        bus = std::make_unique<Bus>(io.get_executor(), clock, settings, std::move(memory));
    }
    void start_bus() {
        make_bus();
        bus->start();
    }
    bool run_until(const std::function<bool()>& so) { return test::run_until(io, clock, so); }
    /// Sends a request; its answer is added to `answers`.
    void send(std::uint8_t station, const Bytes& pdu, std::vector<Answer>& answers,
              ClientId client = 1, bool poll = false) {
        bus->transact({.station = station,
                       .request = test::request_of(pdu),
                       .client = client,
                       .who = who,
                       .poll = poll},
                      [&answers](Answer answer) { answers.push_back(std::move(answer)); });
    }
    /// Sends a request and runs the loop until it is answered.
    Answer ask(std::uint8_t station, const Bytes& pdu = kRead, ClientId client = 1,
               bool poll = false) {
        std::vector<Answer> answers;
        send(station, pdu, answers, client, poll);
        EXPECT_TRUE(answers.empty()) << "answered from inside transact()";
        EXPECT_TRUE(run_until([&] { return !answers.empty(); })) << "it is never answered";
        return answers.empty() ? Answer{} : answers.front();
    }
    /// "timeout, sent", "denied": how a request ended, and whether it was on the line.
    static std::string end_of(const Answer& answer) {
        const std::string end(answer.pdu ? "ok" : label(answer.pdu.error()));
        return answer.transmitted ? end + ", sent" : end;
    }
    Answer ask_silent(std::uint8_t station, const Bytes& pdu = kRead) {
        line->reply.clear();
        Answer answer = ask(station, pdu);
        line->reply = kReply;
        return answer;
    }

    boost::asio::io_context io{1};
    test::ManualClock clock;
    Settings settings;
    test::MemoryLine* line = nullptr;
    WhoRef who;  ///< who asks
    std::unique_ptr<Bus> bus;
};

}  // namespace panelgate::bus
