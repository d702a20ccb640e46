#pragma once

#include <cstddef>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/inline_function.hpp"
#include "panelgate/base/pool.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/tcp_server/counters.hpp"
#include "panelgate/tcp_server/dispatch.hpp"
#include "panelgate/tcp_server/settings.hpp"
#include "panelgate/tls/handshakes.hpp"

namespace panelgate::tcp_server {

/// Rate-limits replies a listener generates itself: refusals and the gateway's registers. No line
/// slows those down, so a client that repeats at once would starve the lines. Up to `most` are
/// given per period; the others wait in order. The queue is bounded by the connections' in-flight
/// limits. Single-threaded.
class OwnAnswers : public std::enable_shared_from_this<OwnAnswers> {
  public:
    /// Sends one answer; false if it is no longer wanted.
    using Give = InlineFunction<bool(), 96>;

    OwnAnswers(rt::Clock& clock, std::size_t most, Duration period);

    /// True if an answer may be sent now; counts it.
    bool try_acquire();
    /// Queues an answer, sent from the loop; never called after this object's end.
    void wait(Give give);

  private:
    void begin_period();
    void serve_waiting();
    void arm();

    rt::Clock& clock_;
    std::size_t most_;
    Duration period_;
    TimePoint end_{};        ///< end of the period
    std::size_t given_ = 0;  ///< answers sent in it
    PoolDeque<Give> waiting_;
    std::unique_ptr<rt::Alarm> next_;
};

/// State shared by a listener and its connections; owned by all of them.
struct Shared {
    Settings settings;
    UnitMap units;
    std::string version;  ///< program version, for the device identification
    rt::Clock& clock;
    Counters counters;
    TimePoint started;
    std::shared_ptr<OwnAnswers> own_answers;        ///< never null
    std::shared_ptr<tls::Handshakes> handshakes{};  ///< null: no TLS
    StrayWrite stray{};                             ///< may be empty
    /// Addresses of clients that asked unit 0 or 255 where nothing is, and were told of.
    std::set<std::string> without_unit{};

    /// Logs one line for this listener.
    void log(rt::LogLevel level, std::string_view event, std::vector<rt::LogField> more = {}) const;
};

}  // namespace panelgate::tcp_server
