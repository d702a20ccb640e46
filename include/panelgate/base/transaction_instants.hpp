#pragma once

#include <optional>

#include "panelgate/base/time.hpp"

namespace panelgate {

/// When what of a request on the wire happened: by the line's rate, from the first bit on.
struct TransactionInstants {
    std::optional<TimePoint> arrived{};  ///< the request that it answers; nothing: nobody's
    TimePoint granted;                   ///< it was its turn
    TimePoint first_bit_out;
    TimePoint last_bit_out;
    std::optional<TimePoint> first_byte_in{};  ///< of what was taken for its reply
    std::optional<TimePoint> last_byte_in{};
};

}  // namespace panelgate
