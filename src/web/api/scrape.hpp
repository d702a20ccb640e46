#pragma once

#include <boost/asio/awaitable.hpp>
#include <memory>

#include "panelgate/web/api/metrics_source.hpp"
#include "panelgate/web/http/caller.hpp"

namespace panelgate::web {

/// One text of /metrics for this caller; null when there is none. When the caller leaves, nothing
/// more is made for it.
boost::asio::awaitable<SharedText> scrape(std::shared_ptr<Caller> caller, MetricsSource* source,
                                          bool gzip);

}  // namespace panelgate::web
