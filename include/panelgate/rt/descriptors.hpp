#pragma once

#include <cstddef>
#include <vector>

namespace panelgate::rt {

/// Lets this process open as many files as it may: the soft limit becomes the hard one. What the
/// limit is then.
std::size_t raise_descriptor_limit();

/// `available` descriptors for those who ask for so many each: all that they ask for, or the same
/// part of it for everybody, but never less than one.
std::vector<std::size_t> share_descriptors(std::size_t available,
                                           const std::vector<std::size_t>& asked);

}  // namespace panelgate::rt
