#include "panelgate/plan/advice.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "changes.hpp"

namespace panelgate::plan {

std::vector<Advice> advise(const Line& line, const LinePlan& plan) {
    std::vector<Advice> all;
    if (verdict(plan) == Verdict::fine) return all;
    const bool changing = is_high_by_changes(plan);
    const auto judged = [&](const auto& one) { return changing ? one.most : one.load; };
    const auto changes = {quicker(line), dearest_read_rarer(line, plan), all_rarer(line, plan),
                          fewer_relays(line)};
    for (const std::optional<Change>& change : changes) {
        if (!change) continue;
        const LinePlan then = make_plan(change->line);
        if (judged(plan) - judged(then) >= kWorthwhile)
            all.push_back({change->what, then.load, then.most});
    }
    std::ranges::sort(all, {}, [&](const Advice& one) { return std::pair(judged(one), one.what); });
    return all;
}

}  // namespace panelgate::plan
