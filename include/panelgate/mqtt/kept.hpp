#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "panelgate/mqtt/message.hpp"

namespace panelgate::mqtt {

/// Messages that are sent until the broker has them, in order, by numbers of their own. Pure.
class Kept {
  public:
    using Numbered = std::map<std::uint64_t, Message>;

    /// `first`: the lowest number; nobody else's.
    explicit Kept(std::uint64_t first) : first_(first), free_(first), next_(first) {}

    void add(Message message) { messages_.emplace(free_++, std::move(message)); }
    /// The next one, which is on its way now.
    std::optional<Numbered::value_type> next() {
        const auto found = messages_.lower_bound(next_);
        if (found == messages_.end()) return std::nullopt;
        next_ = found->first + 1;
        return *found;
    }
    /// Of a number that is none of these: nothing.
    void delivered(std::uint64_t number) { messages_.erase(number); }
    /// What was on its way goes again.
    void lost() { next_ = first_; }

    std::size_t size() const { return messages_.size(); }
    const Numbered& messages() const { return messages_; }

  private:
    std::uint64_t first_;
    std::uint64_t free_;
    std::uint64_t next_;  ///< those below are on their way
    Numbered messages_;
};

}  // namespace panelgate::mqtt
