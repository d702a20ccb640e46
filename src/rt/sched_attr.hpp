#pragma once

#include <cstdint>

namespace panelgate::rt {

/// What sched_getattr(2) and sched_setattr(2) exchange, as Linux has laid it out at first: glibc
/// has no declaration, and <linux/sched/types.h> clashes with <sched.h>.
struct SchedAttr {
    std::uint32_t size = sizeof(SchedAttr);
    std::uint32_t policy = 0;
    std::uint64_t flags = 0;
    std::int32_t nice = 0;
    std::uint32_t priority = 0;
    std::uint64_t runtime = 0;  ///< ns; of SCHED_OTHER: the slice
    std::uint64_t deadline = 0;
    std::uint64_t period = 0;
};

}  // namespace panelgate::rt
