#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace panelgate::web {

/// Server-sent events for those who listen; their types are the words of who publishes. One
/// thread. A listener that reads too slowly loses the oldest and is told how many.
class EventHub {
  public:
    static constexpr std::size_t kWaiting = 1000;  ///< events of one listener
    static constexpr std::size_t kListeners = 64;

    class Listener {
      public:
        /// Called when events wait that did not before, and at the end.
        std::function<void()> wake;
        /// What waits, in the wire format; "" when nothing does.
        std::string take();
        bool ended() const { return ended_; }

      private:
        friend class EventHub;
        std::set<std::string> types_;  ///< empty: all
        std::deque<std::string> waiting_;
        std::uint64_t lost_ = 0;
        bool ended_ = false;
    };

    /// Nothing when too many listen already. Types: empty = all. It listens while it lives.
    std::shared_ptr<Listener> listen(std::set<std::string> types);
    /// `json` is one line.
    void publish(std::string_view type, std::string_view json);
    /// Nobody listens: what would be published need not be made.
    bool is_idle();
    /// The server stops: everybody is sent home.
    void end();

  private:
    std::vector<std::weak_ptr<Listener>> listeners_;
    std::uint64_t last_id_ = 0;
};

}  // namespace panelgate::web
