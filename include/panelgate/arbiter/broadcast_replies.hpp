#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"

namespace panelgate::arbiter {

/// What panels that answer broadcasts, as none should, may still say to the last ones: behind the
/// turnaround it would pass for the reply to a write that is confirmed in the same words (P8).
/// Pure.
class BroadcastReplies {
  public:
    static constexpr std::size_t kBroadcasts = 16;  ///< that are remembered

    void on_sent(TimePoint sent, ByteView request) {
        Sent& oldest = last_[next_++ % kBroadcasts];
        oldest = {sent, modbus::normal_write_reply(request)};
    }
    /// From then on no reply to a broadcast can be taken for that to `request`. `window`: how long
    /// after a broadcast has left its station may answer it.
    TimePoint over(const modbus::Request& request, Duration window) const {
        TimePoint over{};
        if (request.is_read()) return over;
        for (const Sent& one : last_) {
            if (!one.reply.empty() && modbus::answers(request.pdu(), one.reply))
                over = std::max(over, one.at + window);
        }
        return over;
    }

  private:
    struct Sent {
        TimePoint at{};
        Bytes reply;
    };
    std::array<Sent, kBroadcasts> last_;
    std::size_t next_ = 0;
};

}  // namespace panelgate::arbiter
