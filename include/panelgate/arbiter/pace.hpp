#pragma once

namespace panelgate::arbiter {

/// Whether a line that is no real UART behaves like one: replies never begin before the request has
/// left. One that did settles it, until the line is opened again. Pure.
class Pace {
  public:
    void on_reply(bool early) {
        if (early) {
            kept_ = false;
        } else {
            ++timely_;
        }
    }
    bool believed() const { return kept_ && timely_ >= kEnough; }

  private:
    static constexpr int kEnough = 3;

    int timely_ = 0;
    bool kept_ = true;
};

}  // namespace panelgate::arbiter
