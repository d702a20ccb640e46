#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "panelgate/base/time.hpp"
#include "panelgate/web/http/settings.hpp"

namespace panelgate::web {

/// What an address may have of the loop's time, so that whoever asks without a pause slows neither
/// the lines nor other addresses: each request takes some of it, and so does each byte that is made
/// or sent. Who has used up its share and a burst waits before it is answered. Pure.
class Ration {
  public:
    explicit Ration(const RationSettings& settings) : settings_(settings) {}
    void apply(const RationSettings& settings) { settings_ = settings; }

    /// A request is answered with `bytes`. How long it has to wait for that.
    Duration take(TimePoint now, const std::string& address, std::size_t bytes);

  private:
    RationSettings settings_;
    std::map<std::string, TimePoint> used_until_;  ///< by address, those in the future
};

}  // namespace panelgate::web
