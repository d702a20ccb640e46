#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

namespace panelgate::mqtt {

/// The messages of one connection that the broker may not have. Those of quality of service 0 are
/// there when a barrier behind them is acknowledged. Pure.
class OpenMessages {
  public:
    /// `change`: 0 where it is none.
    void sent(int id, bool acknowledged, std::uint64_t change) {
        if (acknowledged) {
            open_[id] = {change};
        } else {
            unconfirmed_.push_back(change);
        }
    }
    /// There are some behind the last barrier, and it has been acknowledged.
    bool wants_barrier() const { return !barrier_ && !unconfirmed_.empty(); }
    /// It was sent behind all of them; 0: it could not be.
    void barrier(int id) {
        if (id == 0) return;
        barrier_ = id;
        behind_.swap(unconfirmed_);
    }
    /// The changes that the broker has now.
    std::vector<std::uint64_t> delivered(int id) {
        if (barrier_ == id) {
            barrier_.reset();
            return std::exchange(behind_, {});
        }
        const auto found = open_.find(id);
        if (found == open_.end()) return {};
        std::vector<std::uint64_t> changes = std::move(found->second);
        open_.erase(found);
        return changes;
    }
    std::size_t size() const { return open_.size() + unconfirmed_.size() + behind_.size(); }
    void clear() { *this = {}; }

  private:
    std::map<int, std::vector<std::uint64_t>> open_;  ///< each until it is acknowledged
    std::vector<std::uint64_t> unconfirmed_;          ///< behind the last barrier
    std::vector<std::uint64_t> behind_;               ///< in front of it
    std::optional<int> barrier_;
};

}  // namespace panelgate::mqtt
