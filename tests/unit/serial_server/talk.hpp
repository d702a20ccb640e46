#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

#include "conversation.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::serial_server::test {

inline constexpr std::uint8_t kOurs = 31;
inline constexpr std::uint8_t kOther = 5;  ///< a slave on the master's own line
inline const Bytes kReadOne = modbus::encode_read(modbus::Table::holding_registers, 0, 1);
inline const Bytes kOneValue{0x03, 0x02, 0x12, 0x34};
inline const Bytes kWrite = modbus::encode_write_register(1, 2);  // its reply is the same
inline const Bytes kRequest = modbus::encode_adu(kOurs, kReadOne);
inline const Bytes kReply = modbus::encode_adu(kOurs, kOneValue);

inline Bytes joined(const std::vector<Bytes>& parts) {
    Bytes all;
    for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
    return all;
}
/// Cuts off the first `size` bytes, or what there is.
inline Bytes take_first(Bytes& bytes, std::size_t size) {
    const auto end = bytes.begin() + static_cast<std::ptrdiff_t>(std::min(size, bytes.size()));
    const Bytes first(bytes.begin(), end);
    bytes.erase(bytes.begin(), end);
    return first;
}

/// A conversation at 9600 8N1 (t3.5 is 3.65 ms) and its results.
struct Talk {
    explicit Talk(const Settings& settings = rtu(EchoMode::off)) : machine(settings, served()) {
        machine.on_line_up();
    }

    static Settings rtu(EchoMode echo = EchoMode::off) {
        Settings settings;
        settings.name = "plc";
        settings.device.serial = {9600, 8, Parity::none, 1};
        settings.access.framing = modbus::Framing::rtu;
        settings.echo = echo;
        return settings;
    }
    static Units served() {
        Units units;
        units[kOurs] = true;
        units[kOurs + 1u] = true;
        return units;
    }

    /// Words apart by blanks: "20" passes 20 ms, "+20" does unobserved; "answer" answers the last
    /// request, "old" the first, "fail" gives no answer; "lost" and "back" are the device. Other
    /// words are frames that are heard, "read~" with a byte each millisecond.
    void play(const std::string& script) {
        std::istringstream words(script);
        for (std::string word; words >> word;) {
            if (word[0] == '+') {
                now += 1ms * std::stoi(word);
            } else if (word[0] >= '0' && word[0] <= '9') {
                pass(1ms * std::stoi(word));
            } else if (word == "answer" || word == "old") {
                const Ask& ask = word == "old" ? asks.front() : asks.back();
                answer_to(ask.ticket, ask.adu.pdu == kWrite ? kWrite : kOneValue);
            } else if (word == "fail") {
                answer(std::nullopt);
            } else if (word == "lost") {
                machine.on_line_down();
            } else if (word == "back") {
                machine.on_line_up();
            } else if (word.back() == '~') {
                word.pop_back();
                hear_slowly(frame(word), 1ms);
            } else {
                hear(frame(word));
            }
            drain();
        }
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

    std::string told;  ///< its actions: "ask 31, withdraw, ask 32, reply 32"
    std::vector<Ask> asks;
    std::vector<Bytes> sent;
    std::vector<TimePoint> sent_at;
    TimePoint now{1h};
    Conversation machine;

  private:
    /// "read/5" is the first five bytes, and "rest" then the others; "echo" is what was sent last;
    /// "+" joins.
    Bytes frame(const std::string& word) {
        if (const auto plus = word.find('+'); plus != std::string::npos) {
            const Bytes first = frame(word.substr(0, plus));
            return joined({first, frame(word.substr(plus + 1))});
        }
        Bytes damaged =
            modbus::encode_adu(kOurs, modbus::encode_read(modbus::Table::holding_registers, 9, 1));
        damaged[4] ^= 0x10;
        const Bytes data = joined({{0x03, 0x08}, kRequest});
        const Bytes last = sent.empty() ? Bytes() : sent.back();
        Bytes collided = last;
        for (std::uint8_t& byte : collided) byte ^= 0x5A;
        const std::map<std::string, Bytes> frames{
            {"read", kRequest},
            {"next", modbus::encode_adu(kOurs + 1, kReadOne)},
            {"write", modbus::encode_adu(kOurs, kWrite)},
            {"broadcast", modbus::encode_adu(0, kWrite)},
            {"foreign", modbus::encode_adu(kOther, kReadOne)},
            {"foreign-data", modbus::encode_adu(kOther, data)},  // it contains a request to us
            {"damaged", damaged},
            {"glitch", Bytes{0x00}},
            {"noise-read", joined({{0x55, 0xAA}, kRequest})},
            {"noise", Bytes{0xC8, 0x57}},
            {"echo", last},
            {"collided-echo", collided},
            {"rest", rest_},
        };
        const auto slash = word.find('/');
        rest_ = frames.at(word.substr(0, slash));
        if (slash == std::string::npos) return rest_;
        return take_first(rest_, std::stoul(word.substr(slash + 1)));
    }
    void tell(const std::string& what) { told += (told.empty() ? "" : ", ") + what; }
    void drain() {
        while (const auto action = machine.poll_action()) {
            if (const auto* ask = std::get_if<Ask>(&*action)) {
                asks.push_back(*ask);
                tell("ask " + std::to_string(ask->adu.station));
            } else if (const auto* spread = std::get_if<ForwardBroadcast>(&*action)) {
                tell("forward " + to_hex(spread->adu.pdu));
            } else if (const auto* send = std::get_if<Send>(&*action)) {
                sent.push_back(send->bytes);
                sent_at.push_back(now);
                tell("reply " + std::to_string(send->bytes[0]));
            } else {
                tell("withdraw");
            }
        }
    }

    Bytes rest_;
};

}  // namespace panelgate::serial_server::test
