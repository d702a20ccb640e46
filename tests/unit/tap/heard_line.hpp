#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/tap/matcher.hpp"

namespace panelgate::tap::test {

inline constexpr SerialFormat kFormat{38400, 8, Parity::none, 1};

/// PDUs that scripts call by a name.
inline constexpr std::pair<std::string_view, std::string_view> kNames[] = {
    {"read", "0300640001"},
    {"other", "0300c80001"},
    {"value", "03020005"},
    {"write", "0600640007"},  // its reply is the same
};

inline std::string name_of(const Bytes& pdu) {
    std::string text = to_hex(pdu, "");
    for (const auto& [name, hex] : kNames) {
        if (text == hex) return std::string(name);
    }
    return text;
}

/// Returns what goes over the wire. "31:read" is a frame of station 31, with a PDU's name or its
/// hex digits; "31:read!" has a wrong bit; "~ff00" are these bytes; "+" joins.
inline Bytes bytes_of(std::string_view text) {
    if (const auto plus = text.find('+'); plus != std::string_view::npos) {
        Bytes joined = bytes_of(text.substr(0, plus));
        const Bytes more = bytes_of(text.substr(plus + 1));
        joined.insert(joined.end(), more.begin(), more.end());
        return joined;
    }
    if (text.empty()) return {};
    if (text.front() == '~') return *from_hex(text.substr(1));
    const bool damaged = text.back() == '!';
    if (damaged) text.remove_suffix(1);
    const auto colon = text.find(':');
    std::string_view pdu = text.substr(colon + 1);
    for (const auto& [name, hex] : kNames) {
        if (pdu == name) pdu = hex;
    }
    const int station = std::stoi(std::string(text.substr(0, colon)));
    Bytes adu = modbus::encode_adu(static_cast<std::uint8_t>(station), *from_hex(pdu));
    if (damaged) adu[4] ^= 0x10;
    return adu;
}

/// A line that the tap listens to: who sends what, when.
class Line {
  public:
    /// Steps apart by commas: a pause in milliseconds and what is heard after it, a frame byte by
    /// byte, and all in one chunk if a "+", "~" or "!" is in it; or "silence", or "lost".
    void play(std::string_view script) {
        std::istringstream steps{std::string(script)};
        std::string what;
        for (int pause = 0; steps >> pause >> what;) {
            if (what.back() == ',') what.pop_back();
            if (what == "silence") {
                wait(1ms * pause);
            } else if (what == "lost") {
                matcher_.on_line_down(now_);
                collect();
            } else if (what.find_first_of("+~!") == std::string::npos) {
                say(1ms * pause, what);
            } else {
                hear(1ms * pause, bytes_of(what));
            }
        }
    }
    /// A good frame begins this long after the last byte, and is heard byte by byte.
    void say(Duration pause, std::string_view frame) {
        const Bytes adu = bytes_of(frame);
        wait(pause);
        for (const std::uint8_t byte : adu) {
            now_ += character_time(kFormat);
            matcher_.on_rx(now_, ByteView(&byte, 1));
        }
        collect();
    }
    /// All of it in one chunk.
    void hear(Duration pause, const Bytes& bytes) {
        wait(pause + wire_time(kFormat, bytes.size()));
        matcher_.on_rx(now_, bytes);
        collect();
    }
    void wait(Duration pause) {
        const TimePoint until = now_ + pause;
        for (auto next = matcher_.next_deadline(); next && *next <= until;
             next = matcher_.next_deadline()) {
            now_ = std::max(now_, *next);
            matcher_.on_deadline(now_);
            collect();
        }
        now_ = until;
    }
    TimePoint now() const { return now_; }
    /// The transactions since the last call: "31: read -> value; 5: write -> silent ?".
    std::string told() { return std::exchange(told_, {}); }
    std::vector<Transaction> transactions;
    std::vector<FrameKind> frames;

  private:
    void collect() {
        while (const auto event = matcher_.poll_action()) {
            if (const auto* frame = std::get_if<Frame>(&*event)) {
                frames.push_back(frame->kind);
                continue;
            }
            const auto& one = std::get<Transaction>(*event);
            transactions.push_back(one);
            told_ += (told_.empty() ? "" : "; ") + words(one);
        }
    }
    static std::string words(const Transaction& one) {
        static constexpr const char* kEnds[] = {"", "silent", "damaged", "unasked", "wrong"};
        std::string text = std::to_string(one.station) + ": " + name_of(one.request) + " -> ";
        text += one.end == End::answered ? name_of(one.reply)
                                         : kEnds[static_cast<std::size_t>(one.end)];
        return one.doubtful ? text + " ?" : text;
    }

    Matcher matcher_{Settings{kFormat}};
    TimePoint now_{1h};
    std::string told_;
};

}  // namespace panelgate::tap::test
