#pragma once

#include <cstddef>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::arbiter {

/// What other masters of the line have asked, as far as it was heard: what answers one of these may
/// be its reply. Pure.
class Questions {
  public:
    static constexpr std::size_t kMost = 8;  ///< the oldest is forgotten beyond that

    /// These bytes begin with another master's request. Nobody answers a broadcast.
    void on_heard(TimePoint now, ByteView bytes);
    bool empty() const { return asked_.empty(); }
    void clear() { asked_.clear(); }
    /// This frame answers one that was heard at `since` or later.
    bool fit(ByteView adu, TimePoint since = TimePoint::min()) const;

  private:
    struct Question {
        TimePoint at{};
        Bytes adu;
    };
    std::vector<Question> asked_;
};

}  // namespace panelgate::arbiter
