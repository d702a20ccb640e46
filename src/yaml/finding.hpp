#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace panelgate::yaml {

/// What is wrong at one place of a text.
struct Finding {
    std::size_t offset = 0;
    std::string message;
};
using Findings = std::vector<Finding>;

}  // namespace panelgate::yaml
