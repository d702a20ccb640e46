#pragma once

#include <algorithm>
#include <vector>

namespace panelgate::scan {

/// Keeps a list without repetitions, in the order of first mention.
template <class T>
void append_new(std::vector<T>& list, const T& value) {
    if (std::ranges::find(list, value) == list.end()) list.push_back(value);
}

}  // namespace panelgate::scan
