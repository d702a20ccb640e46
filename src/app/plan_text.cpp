#include <cmath>
#include <string>

#include "capacity.hpp"
#include "panelgate/base/number_text.hpp"
#include "panelgate/plan/highest_rate.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::app {
namespace {

using yaml::format_duration;

constexpr const char* kChanging = " while values change";

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
    if (relay.most > relay.load) text += ", " + percent(relay.most) + kChanging;
    return text + '\n';
}

std::string text_of(const plan::OneDead& dead) {
    return "  with " + dead.station + " dead: " + percent(dead.load) +
           " at most; a station that falls silent holds the others up for " +
           milliseconds(dead.holds) + ", once\n";
}

std::string headroom_of(const Capacity& capacity) {
    const plan::LinePlan& plan = capacity.plan;
    std::string text = "  left for clients: " + percent(plan.free_share()) + ", " +
                       rounded(plan.free_reads()) + " reads of " +
                       std::to_string(plan::kClientRead) + " registers a second\n";
    if (const auto highest = plan::highest_rate(capacity.line, plan)) {
        text += "  highest rate: all of this " + rounded(highest->times) +
                " times as often, up to " +
                (highest->changing ? percent(plan::kFull) + kChanging : percent(plan::kHigh)) +
                "; once through takes " + milliseconds(plan.once) + '\n';
    }
    return text;
}

/// What it is judged by first: certain, or while values change.
std::string text_of(const plan::Advice& advice, bool changing) {
    std::string text = advice.what + " brings ";
    if (changing) return text + percent(advice.most) + kChanging;
    text += percent(advice.load);
    if (advice.most > advice.load) text += " (" + percent(advice.most) + kChanging + ')';
    return text;
}

}  // namespace

std::string plan_text(const Capacity& capacity) {
    const plan::LinePlan& plan = capacity.plan;
    std::string text = "plan of line " + plan.line + ", " + to_string(capacity.line.serial) + ": " +
                       percent(plan.load) + " of its time";
    if (plan.most > plan.load) text += ", " + percent(plan.most) + kChanging;
    text += '\n';
    for (const plan::Poll& poll : plan.polls) text += text_of(poll);
    for (const plan::RelayLoad& relay : plan.relays) text += text_of(relay);
    if (plan.listens) return text + "  it only listens: nothing is ever sent there\n";
    if (plan.dead) text += text_of(*plan.dead);
    text += headroom_of(capacity);
    const bool changing = plan::is_high_by_changes(plan);
    for (const plan::Advice& advice : capacity.advice)
        text += "  advice: " + text_of(advice, changing) + '\n';
    return text;
}

std::string overload_text(const Capacity& capacity) {
    const plan::LinePlan& plan = capacity.plan;
    const bool changing = plan::is_high_by_changes(plan);
    std::string text = "line " + plan.line + " is planned to be busy for " +
                       percent(changing ? plan.most : plan.load) + " of its time at " +
                       to_string(capacity.line.serial);
    if (plan::verdict(plan) == plan::Verdict::overload) {
        text += ": polls will be late for ever";
    } else if (changing) {
        text += std::string(kChanging) +
                " that relays copy: they will arrive late, and clients wait long";
    } else {
        text += ": above " + percent(plan::kHigh) + " clients wait long";
    }
    for (const plan::Advice& advice : capacity.advice) text += "; " + text_of(advice, changing);
    return text;
}

}  // namespace panelgate::app
