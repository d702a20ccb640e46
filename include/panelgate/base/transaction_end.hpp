#pragma once

#include <cstdint>
#include <string_view>

namespace panelgate {

/// What a request on the wire came to, for traces: of one attempt, not of what a client asked.
enum class TransactionEnd : std::uint8_t {
    open,  ///< it is still on the wire
    ok,    ///< its reply has come; a broadcast has left
    exception,
    timeout,
    damaged,
    wrong,      ///< a good frame of its station that does not answer it
    doubtful,   ///< what came may be a copy of an earlier reply: it is asked for once more
    line_down,  ///< the line was lost meanwhile
};

std::string_view label(TransactionEnd end);
/// It ended without its reply.
bool is_error(TransactionEnd end);

}  // namespace panelgate
