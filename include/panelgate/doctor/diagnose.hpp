#pragma once

#include <cstdint>
#include <vector>

#include "panelgate/doctor/finding.hpp"
#include "panelgate/doctor/sample.hpp"

namespace panelgate::doctor {

/// What the counts of a window tell, the likeliest cause first: in the order of Cause, and by
/// station. A healthy line, or one that was not used, gives nothing. A finding that is `standing`
/// stays by about half of the evidence that a new one needs. Pure.
std::vector<Finding> diagnose(const LineFacts& facts, const Sample& window,
                              const std::vector<Finding>& standing = {});

}  // namespace panelgate::doctor
