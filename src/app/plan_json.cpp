#include <boost/json/array.hpp>
#include <cmath>
#include <string_view>
#include <utility>

#include "capacity.hpp"
#include "panelgate/plan/highest_rate.hpp"

namespace panelgate::app {
namespace {

namespace json = boost::json;

double rounded(double value) { return std::round(value * 1000) / 1000; }
double percent(double load) { return rounded(100 * load); }
double milliseconds(Duration time) { return rounded(1000 * to_seconds(time)); }

json::object poll_json(const plan::Poll& poll) {
    return {{"station", poll.station},
            {"read", poll.read},
            {"count", poll.count},
            {"every_ms", milliseconds(poll.every)},
            {"wire_ms", milliseconds(poll.wire)},
            {"load_percent", percent(poll.load)}};
}

json::object relay_json(const plan::RelayLoad& relay) {
    return {{"relay", relay.relay},
            {"station", relay.station},
            {"request", plan::label(relay.request)},
            {"every_ms", milliseconds(relay.every)},
            {"wire_ms", milliseconds(relay.wire)},
            {"load_percent", percent(relay.load)},
            {"most_percent", percent(relay.most)}};
}

json::object highest_rate_json(const Capacity& capacity) {
    json::object made{{"once_ms", milliseconds(capacity.plan.once)}};
    if (const auto highest = plan::highest_rate(capacity.line, capacity.plan)) {
        made["times_as_often"] = rounded(highest->times);
        made["limited_by"] = highest->changing ? "most_percent" : "load_percent";
    }
    return made;
}

std::string_view word(plan::Verdict verdict) {
    switch (verdict) {
        case plan::Verdict::fine:
            return "fine";
        case plan::Verdict::high:
            return "high";
        case plan::Verdict::overload:
            return "overload";
    }
    std::abort();
}

}  // namespace

void add_plan(json::object& line, const Capacity& capacity) {
    const plan::LinePlan& plan = capacity.plan;
    json::array polls;
    for (const plan::Poll& poll : plan.polls) polls.push_back(poll_json(poll));
    json::array relays;
    for (const plan::RelayLoad& relay : plan.relays) relays.push_back(relay_json(relay));
    json::array advice;
    for (const plan::Advice& one : capacity.advice)
        advice.push_back(json::object{{"what", one.what},
                                      {"load_percent", percent(one.load)},
                                      {"most_percent", percent(one.most)}});
    line["load_percent"] = percent(plan.load);
    line["most_percent"] = percent(plan.most);
    line["verdict"] = word(plan::verdict(plan));
    line["polls"] = std::move(polls);
    line["relays"] = std::move(relays);
    if (plan.dead) {
        line["one_dead"] = json::object{{"station", plan.dead->station},
                                        {"load_percent", percent(plan.dead->load)},
                                        {"holds_ms", milliseconds(plan.dead->holds)}};
    }
    line["highest_rate"] = highest_rate_json(capacity);
    line["headroom"] = json::object{{"load_percent", percent(plan.free_share())},
                                    {"reads_per_second", rounded(plan.free_reads())}};
    line["advice"] = std::move(advice);
}

}  // namespace panelgate::app
