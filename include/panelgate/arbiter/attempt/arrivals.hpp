#pragma once

#include <algorithm>
#include <cstddef>

#include "panelgate/base/pool.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

/// When bytes came that may be judged much later: those in a hum end with it. Bounded. Pure.
class Arrivals {
  public:
    void add(TimePoint now, std::size_t bytes) {
        if (reads_.size() >= kMost) reads_.erase(reads_.begin(), reads_.begin() + kMost / 2);
        reads_.push_back({now, total_ += bytes});
    }
    /// When the byte came behind which so many have come; something must have.
    TimePoint before(std::size_t behind) const {
        return std::ranges::lower_bound(reads_, total_ - behind, {}, &Read::total)->at;
    }

  private:
    struct Read {
        TimePoint at;
        std::size_t total;  ///< bytes, with these
    };
    static constexpr std::ptrdiff_t kMost = 512;

    PoolVector<Read> reads_;
    std::size_t total_ = 0;
};

}  // namespace panelgate::arbiter
