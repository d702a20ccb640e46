#pragma once

namespace panelgate::arbiter {

/// Whether a line that is no real UART behaves like one: replies never begin before the request has
/// left, and no bytes come faster than the line's rate. One that did settles it, until the line is
/// opened again; several early ones in a row, and the line is not bound to its rate at all. Pure.
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
    void on_hasty() { hasty_ = true; }
    /// Nothing has come sooner than the line's rate allows.
    bool kept() const { return kept_ && !hasty_; }
    bool believed() const { return kept_ && timely_ >= kEnough; }
    /// One early reply may be a late one, to a request that was sent again.
    bool unbound() const { return early_ >= kEnough; }

  private:
    static constexpr int kEnough = 3;

    int timely_ = 0;
    int early_ = 0;  // in a row
    bool kept_ = true;
    bool hasty_ = false;
};

}  // namespace panelgate::arbiter
