#pragma once

#include <algorithm>

namespace panelgate::arbiter {

/// Whether a line that is no real UART behaves like one: replies never begin before the request has
/// left, and no bytes come faster than the line's rate. One early reply settles it, until the line
/// is opened again; several early ones in a row, and the line is not bound to its rate at all.
/// Haste may be a sender that was held up by its machine: it has to happen again, and is forgotten.
/// Pure.
class Pace {
  public:
    void on_reply(bool early) {
        if (early) {
            kept_ = false;
            ++early_;
        } else {
            ++timely_;
            early_ = 0;
        }
    }
    /// Did bytes of a reply come sooner than the line's rate allows?
    void on_rate(bool hasty) {
        hasty_ = hasty ? std::min(hasty_ + kWeight, kHasty * kWeight) : std::max(hasty_ - 1, 0);
    }
    /// Nothing comes sooner than the line's rate allows, but for the odd one in kWeight replies.
    bool kept() const { return kept_ && hasty_ <= (kHasty - 1) * kWeight; }
    bool believed() const { return kept_ && timely_ >= kEnough; }
    /// One early reply may be a late one, to a request that was sent again.
    bool unbound() const { return early_ >= kEnough; }

  private:
    static constexpr int kEnough = 3;
    static constexpr int kHasty = 3;
    static constexpr int kWeight = 8;

    int timely_ = 0;
    int early_ = 0;  // in a row
    bool kept_ = true;
    int hasty_ = 0;  // a hasty one: kWeight; any other: 1 less
};

}  // namespace panelgate::arbiter
