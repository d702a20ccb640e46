#include <cmath>
#include <string>

#include "capacity.hpp"
#include "panelgate/base/number_text.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::app {
namespace {

using yaml::format_duration;

std::string rounded(double value) { return number_text(std::round(value * 10) / 10); }
std::string percent(double load) { return rounded(100 * load) + " %"; }
std::string milliseconds(Duration time) { return rounded(1000 * to_seconds(time)) + "ms"; }

std::string text_of(const plan::Poll& poll) {
    return "  asks " + poll.station + ' ' + poll.read + ", count " + std::to_string(poll.count) +
           ", every " + format_duration(poll.every) + ": " + milliseconds(poll.wire) + ", " +
           percent(poll.load) + '\n';
}

std::string text_of(const plan::RelayLoad& relay) {
    std::string text = "  relay " + relay.relay + ": " + std::string(label(relay.request)) +
                       " of " + relay.station + " every " + format_duration(relay.every) + ": " +
                       milliseconds(relay.wire) + ", " + percent(relay.load);
    if (relay.most > relay.load) text += ", " + percent(relay.most) + " while values change";
    return text + '\n';
}

std::string text_of(const plan::OneDead& dead) {
    return "  with " + dead.station + " dead: " + percent(dead.load) +
           " at most; a station that falls silent holds the others up for " +
           milliseconds(dead.holds) + ", once\n";
}

std::string headroom_of(const plan::LinePlan& plan) {
    std::string text = "  left for clients: " + percent(std::max(0.0, plan::kFull - plan.load)) +
                       ", " + rounded(plan.free_reads()) + " reads of " +
                       std::to_string(plan::kClientRead) + " registers a second\n";
    if (const auto times = plan.times_as_often()) {
        text += "  highest rate: all of this " + rounded(*times) + " times as often, up to " +
                percent(plan::kHigh) + "; once through takes " + milliseconds(plan.once) + '\n';
    }
    return text;
}

std::string text_of(const plan::Advice& advice) {
    return advice.what + " brings " + percent(advice.load);
}

}  // namespace

std::string plan_text(const Capacity& capacity) {
    const plan::LinePlan& plan = capacity.plan;
    std::string text = "plan of line " + plan.line + ", " + to_string(capacity.line.serial) + ": " +
                       percent(plan.load) + " of its time";
    if (plan.most > plan.load) text += ", " + percent(plan.most) + " while values change";
    text += '\n';
    for (const plan::Poll& poll : plan.polls) text += text_of(poll);
    for (const plan::RelayLoad& relay : plan.relays) text += text_of(relay);
    if (plan.dead) text += text_of(*plan.dead);
    text += headroom_of(plan);
    for (const plan::Advice& advice : capacity.advice)
        text += "  advice: " + text_of(advice) + '\n';
    return text;
}

std::string overload_text(const Capacity& capacity) {
    const plan::LinePlan& plan = capacity.plan;
    const bool sure = plan.load > plan::kHigh;
    std::string text = "line " + plan.line + " is planned to be busy for " +
                       percent(sure ? plan.load : plan.most) + " of its time at " +
                       to_string(capacity.line.serial);
    if (!sure) text += " while values change that relays copy";
    text += plan::verdict(plan) == plan::Verdict::overload
                ? ": polls will be late for ever"
                : ": above " + percent(plan::kHigh) + " clients wait long";
    for (const plan::Advice& advice : capacity.advice) text += "; " + text_of(advice);
    return text;
}

}  // namespace panelgate::app
