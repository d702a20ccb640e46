#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>

#include "panelgate/base/bytes.hpp"

namespace panelgate::arbiter {

/// What was heard of each station before, as far as the line diagnosis compares it: its latest
/// replies, and its latest reads that went unanswered. By hash; bounded.
class HeardBefore {
  public:
    /// A reply was accepted. Returns true if the same read went unanswered a while ago.
    bool on_answered(std::uint8_t station, ByteView request, ByteView reply);
    void on_unanswered(std::uint8_t station, ByteView request);
    /// True if the station has said this not last, but a while ago.
    bool is_old_reply(std::uint8_t station, ByteView pdu) const;

  private:
    static constexpr std::size_t kReplies = 8;
    static constexpr std::size_t kReads = 16;

    struct One {
        std::array<std::size_t, kReplies> replies{};  ///< 0: none
        std::array<std::size_t, kReads> unanswered{};
        std::size_t next_reply = 0;
        std::size_t next_read = 0;
    };
    std::map<std::uint8_t, One> stations_;
};

}  // namespace panelgate::arbiter
