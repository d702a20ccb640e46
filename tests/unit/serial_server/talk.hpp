#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "conversation.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::serial_server::test {

inline constexpr std::uint8_t kOurs = 31;
inline constexpr std::uint8_t kOther = 5;  ///< a slave on the master's own line
inline const Bytes kReadOne = modbus::encode_read(modbus::Table::holding_registers, 0, 1);
inline const Bytes kOneValue{0x03, 0x02, 0x12, 0x34};

inline Bytes joined(std::vector<Bytes> parts) {
    Bytes all;
    for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
    return all;
}

/// A conversation at 9600 8N1 (t3.5 is 3.65 ms) and its results.
struct Talk {
    explicit Talk(Settings settings = rtu()) : machine(settings, served()) { machine.on_line_up(); }

    static Settings rtu() {
        Settings settings;
        settings.name = "plc";
        settings.device.serial = {9600, 8, Parity::none, 1};
        settings.access.framing = modbus::Framing::rtu;
        settings.echo = EchoMode::off;
        return settings;
    }
    static Units served() {
        Units units;
        units[kOurs] = true;
        units[kOurs + 1u] = true;
        return units;
    }

    void hear(const Bytes& bytes) {
        machine.on_rx(now, bytes);
        drain();
    }
    /// Delivers the bytes one at a time, `hole` apart.
    void hear_slowly(const Bytes& bytes, Duration hole) {
        for (const std::uint8_t byte : bytes) {
            hear({byte});
            pass(hole);
        }
    }
    void answer(const std::optional<Bytes>& pdu) { answer_to(asks.back().ticket, pdu); }
    void answer_to(std::uint64_t ticket, const std::optional<Bytes>& pdu) {
        machine.on_answer(now, ticket, pdu);
        drain();
    }
    /// Advances the time, serving every deadline.
    void pass(Duration by) {
        const TimePoint end = now + by;
        while (true) {
            const auto next = machine.next_deadline();
            if (!next || *next > end) break;
            now = std::max(now, *next);
            machine.on_deadline(now);
            drain();
        }
        now = end;
    }

    std::vector<Ask> asks;
    std::vector<ForwardBroadcast> spreads;
    std::vector<Bytes> sent;
    std::vector<TimePoint> sent_at;
    int withdrawals = 0;
    TimePoint now{1h};
    Conversation machine;

  private:
    void drain() {
        while (auto action = machine.poll_action()) {
            if (auto* ask = std::get_if<Ask>(&*action)) asks.push_back(*ask);
            if (auto* spread = std::get_if<ForwardBroadcast>(&*action)) spreads.push_back(*spread);
            if (std::holds_alternative<Withdraw>(*action)) ++withdrawals;
            if (auto* send = std::get_if<Send>(&*action)) {
                sent.push_back(send->bytes);
                sent_at.push_back(now);
            }
        }
    }
};

}  // namespace panelgate::serial_server::test
