#pragma once

#include <cstddef>
#include <memory>
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

namespace panelgate::tcp_server {

/// Paces what a listener answers by itself: refusals, and the registers of the gateway. No line
/// slows that down, so whoever asks again at once would keep the loop from the lines. So many are
/// given in a period, at once; the others wait for the next one, in their order. Those that wait
/// are bounded by what their connections may have in flight. One thread.
class OwnAnswers : public std::enable_shared_from_this<OwnAnswers> {
  public:
    /// Gives one; false: nobody wants it any more.
    using Give = InlineFunction<bool(), 96>;

    OwnAnswers(rt::Clock& clock, std::size_t most, Duration period);

    /// Whether one may be given now; it counts as given then.
    bool may_give();
    /// Later, from the loop. Never called after the end of this object.
    void wait(Give give);

  private:
    void begin_period();
    void give_waiting();
    void arm();

    rt::Clock& clock_;
    std::size_t most_;
    Duration period_;
    TimePoint end_{};        ///< of the period
    std::size_t given_ = 0;  ///< in it
    PoolDeque<Give> waiting_;
    std::unique_ptr<rt::Alarm> next_;
};

/// What the connections of one listener share; held by the listener and by each of them.
struct Shared {
    Settings settings;
    UnitMap units;
    std::string version;  ///< of the program, for the device identification
    rt::Clock& clock;
    Counters counters;
    TimePoint started;
    std::shared_ptr<OwnAnswers> own_answers;  ///< never null

    /// One line of this listener.
    void log(rt::LogLevel level, std::string_view event, std::vector<rt::LogField> more = {}) const;
};

}  // namespace panelgate::tcp_server
