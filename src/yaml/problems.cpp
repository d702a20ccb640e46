#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "panelgate/yaml/document.hpp"
#include "panelgate/yaml/settings.hpp"

namespace panelgate::yaml {

std::string format(const Problem& problem) {
    return problem.file + ':' + std::to_string(problem.mark.line) + ':' +
           std::to_string(problem.mark.column) + ": " + problem.message;
}

std::string Problems::text() const {
    std::vector<const Problem*> sorted;
    sorted.reserve(list_.size());
    for (const Problem& problem : list_) sorted.push_back(&problem);
    const auto place = [this](const Problem* problem) {
        return std::tuple(problem->file != file_, std::string_view(problem->file),
                          problem->mark.line, problem->mark.column, problem);
    };
    std::ranges::sort(sorted, {}, place);  // at one place: in the order found
    const std::size_t shown = sorted.size() > kMaxTold + 1 ? kMaxTold : sorted.size();
    std::string all;
    for (std::size_t i = 0; i < shown; ++i) all += format(*sorted[i]) + '\n' + sorted[i]->excerpt;
    if (shown == sorted.size()) return all;
    Problem rest = *sorted[shown];
    rest.message = std::to_string(sorted.size() - shown) +
                   " more faults from here on; mend those above and check again";
    return all + format(rest) + '\n';
}

}  // namespace panelgate::yaml
