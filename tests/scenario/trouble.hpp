#pragma once

#include <functional>

#include "agenda.hpp"
#include "plan.hpp"
#include "random.hpp"
#include "wire.hpp"

namespace panelgate::scenario {

/// Who else speaks on the wire: noise, a babbler, another master with a panel of its own.
class Trouble {
  public:
    Trouble(const Plan& plan, Agenda& agenda, Wire& wire, Random& random,
            std::function<bool()> is_over)
        : plan_(plan),
          agenda_(agenda),
          wire_(wire),
          random_(random),
          is_over_(std::move(is_over)) {}
    Trouble(const Trouble&) = delete;
    Trouble& operator=(const Trouble&) = delete;

    void start();

  private:
    void make_noise();
    void begin_to_float();
    void hum(TimePoint until);
    void babble();
    void listen();
    void ask_own_panel();
    Bytes foreign_read() const;

    const Plan& plan_;
    Agenda& agenda_;
    Wire& wire_;
    Random& random_;
    std::function<bool()> is_over_;
    TimePoint next_question_{};
};

}  // namespace panelgate::scenario
