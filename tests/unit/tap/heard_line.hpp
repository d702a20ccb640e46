#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/tap/matcher.hpp"

namespace panelgate::tap::test {

inline constexpr SerialFormat kFormat{38400, 8, Parity::none, 1};

inline Bytes pdu(std::string_view hex) { return *from_hex(hex); }

/// A line that the tap listens to: who sends what, when.
class Line {
  public:
    explicit Line(Settings settings = {kFormat}) : matcher_(settings) {}

    /// A good frame begins this long after the last byte, and is heard byte by byte.
    void say(Duration pause, std::uint8_t station, std::string_view hex) {
        const Bytes adu = modbus::encode_adu(station, pdu(hex));
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
    void lose() {
        matcher_.on_line_down(now_);
        collect();
    }
    TimePoint now() const { return now_; }
    /// "1f 03 0000 0001 -> 03 02 00 05": one line each.
    std::vector<std::string> told() { return std::exchange(told_, {}); }
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
            told_.push_back(words(one));
        }
    }
    static std::string words(const Transaction& one) {
        static constexpr const char* kEnds[] = {"", "silent", "damaged", "unasked"};
        std::string text = std::to_string(one.station) + ": " + to_hex(one.request, "") + " -> ";
        text += one.end == End::answered ? to_hex(one.reply, "")
                                         : kEnds[static_cast<std::size_t>(one.end)];
        return one.doubtful ? text + " ?" : text;
    }

    Matcher matcher_;
    TimePoint now_{1h};
    std::vector<std::string> told_;
};

}  // namespace panelgate::tap::test
