#pragma once

#include <functional>
#include <optional>
#include <string_view>

#include "panelgate/base/time.hpp"
#include "panelgate/web/http/message.hpp"

namespace panelgate::web {

/// N of "Prefer: wait=N" (RFC 7240 4.3): a whole number of seconds. Nothing for anything else,
/// which is no error there.
std::optional<Duration> wait_of(std::string_view prefer);
/// The same of a request's header.
std::optional<Duration> wait_of(const HttpRequest& request);

/// Until when a request is to be answered, however many transactions it takes: by its line's
/// deadline, or when its client stops waiting, where that is sooner (P3).
class Patience {
  public:
    /// `now` is called whenever it is asked.
    Patience(const HttpRequest& request, Duration deadline, const std::function<TimePoint()>& now);

    /// Zero when the time is over.
    Duration left() const;

  private:
    const std::function<TimePoint()>* now_;
    TimePoint end_;
};

}  // namespace panelgate::web
