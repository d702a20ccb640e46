#pragma once

#include <cstdint>

namespace panelgate::test {

/// How often this thread has asked the heap for memory by operator new. With PANELGATE_SHOW_NEW in
/// the environment each one that is watched says where it comes from, on stderr.
std::uint64_t allocations();
/// From now on, or no more.
void watch_allocations(bool watch);
/// This build's heap is somebody else's (AddressSanitizer): counting tells nothing.
bool counts_allocations();

}  // namespace panelgate::test
