#pragma once

#include <cstdint>
#include <functional>

#include "panelgate/web/http/message.hpp"

namespace panelgate::web {

/// Makes the text of /metrics for whoever asks. One thread.
class MetricsSource {
  public:
    /// Null: there is none, because too many are under way or the caller was cancelled.
    using Handler = std::function<void(SharedText)>;

    virtual ~MetricsSource() = default;
    /// The handler is called once, with figures that are not older than this call; never from
    /// inside it. `gzip`: the text in that content coding. A caller asks for one at a time.
    virtual void scrape(std::uint64_t caller, bool gzip, Handler handler) = 0;
    /// The caller does not wait any more: it is handed null.
    virtual void cancel(std::uint64_t caller) = 0;
};

}  // namespace panelgate::web
