#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/arbiter/settings.hpp"
#include "rules.hpp"
#include "subject.hpp"
#include "support/bus_step.hpp"
#include "visited.hpp"
#include "world.hpp"

namespace panelgate::explorer {

/// What an arbiter came to that was broken, or told something wrong.
struct Found {
    std::string violation;
    std::vector<Move> moves;  ///< no shorter script leads to any violation
};

/// Tries everything that can happen in a small world: all scripts of one move, of two, of three…
/// A state that was seen is not explored again, unless more moves or faults are left than then.
class Explorer {
  public:
    Explorer(const Rules& rules, Flaw flaw) : Explorer(rules, rules.settings, flaw) {}
    /// `told`: what the arbiter believes.
    Explorer(const Rules& rules, const arbiter::Settings& told, Flaw flaw)
        : rules_(rules), told_(told), flaw_(flaw) {}
    Explorer(const Explorer&) = delete;
    Explorer& operator=(const Explorer&) = delete;
    ~Explorer();

    /// Until so many states were seen, or all scripts of `depth` moves tried, or one went wrong.
    std::optional<Found> run(std::size_t states, int depth = 100);

    std::size_t states() const { return visited_.size(); }
    std::uint64_t moves() const { return moves_; }
    /// All scripts of so many moves were tried.
    int depth() const { return depth_; }

    /// The script that is being tried, in words.
    std::string where() const;
    /// The script in words, and as the body of a test with a BusScript.
    std::string tell(const std::vector<Move>& moves) const;
    /// The same as steps of a BusScript.
    std::vector<test::BusStep> steps(const std::vector<Move>& moves) const;

  private:
    bool search(const World& world, int left);
    bool enough() const { return visited_.size() >= limit_; }

    Rules rules_;
    arbiter::Settings told_;
    Flaw flaw_;
    Visited visited_;
    std::vector<Move> path_;
    std::string violation_;
    std::uint64_t moves_ = 0;
    std::size_t limit_ = 0;
    int depth_ = 0;
};

}  // namespace panelgate::explorer
