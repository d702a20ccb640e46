#include "explorer.hpp"

#include <csignal>
#include <cstdio>

namespace panelgate::explorer {
namespace {

const Explorer* at_work = nullptr;

/// An arbiter that checks itself ends the program: where was it?
void tell_where(int) {
    if (at_work != nullptr) std::fputs(at_work->where().c_str(), stderr);
}

}  // namespace

Explorer::~Explorer() {
    if (at_work == this) at_work = nullptr;
}

std::string Explorer::where() const {
    const World start(rules_, told_, flaw_);
    std::string text = rules_.name + ": it came to that by this, or behind it when all ask\n";
    for (const Move move : path_) text += "    // " + start.describe(move) + "\n";
    return text;
}

std::optional<Found> Explorer::run(std::size_t states, int depth) {
    at_work = this;
    std::signal(SIGABRT, tell_where);
    limit_ = states;
    const World start(rules_, told_, flaw_);
    while (depth_ < depth && !enough()) {
        path_.clear();
        if (search(start, depth_ + 1)) return Found{violation_, path_};
        if (!enough()) ++depth_;
    }
    return std::nullopt;
}

/// True when a violation was found; the path leads to it.
bool Explorer::search(const World& world, int left) {
    for (const Move move : world.moves()) {
        if (enough()) return false;
        World next(world);
        path_.push_back(move);
        next.play(move);
        ++moves_;
        if (next.violation().empty()) {
            const auto was = visited_.visit(next.digest(), next.faults(), left - 1);
            if (was != Visited::Was::known && left > 1 && search(next, left - 1)) return true;
            if (was == Visited::Was::unknown && left == 1) next.run_on();
        }
        if (!next.violation().empty()) {
            violation_ = next.violation();
            return true;
        }
        path_.pop_back();
    }
    return false;
}

std::vector<test::BusStep> Explorer::steps(const std::vector<Move>& moves) const {
    std::vector<test::BusStep> steps;
    World world(rules_, told_, flaw_);
    world.record(&steps);
    for (const Move move : moves) world.play(move);
    world.run_on();
    return steps;
}

std::string Explorer::tell(const std::vector<Move>& moves) const {
    std::vector<test::BusStep> steps;
    World world(rules_, told_, flaw_);
    world.record(&steps);
    std::string text;
    const auto add = [&](const std::string& words) {
        text += "    // " + words + "\n";
        for (const test::BusStep& step : steps) text += "    " + test::to_code(step) + "\n";
        steps.clear();
    };
    for (const Move move : moves) {
        const std::string words = world.describe(move);
        world.play(move);
        add(words);
    }
    if (world.violation().empty()) {
        world.run_on();
        add("nothing more");
    }
    return text + "    // " + std::string(world.violation()) + "\n";
}

}  // namespace panelgate::explorer
