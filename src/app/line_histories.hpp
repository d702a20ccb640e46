#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/bus/line_bus.hpp"
#include "panelgate/bus/line_history.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::app {

/// Looks at each line once a slot of its history, at one line at a time. One thread.
class LineHistories {
  public:
    static constexpr std::size_t kBytes = 4 * 1024 * 1024;  ///< of all lines

    /// The clock and the lines outlive it.
    LineHistories(rt::Clock& clock, std::vector<const bus::LineBus*> lines);

    /// From now on these. The past of those that are among them stays, unless slots have another
    /// width.
    void apply(std::vector<const bus::LineBus*> lines);

    void start();
    void stop();
    /// By the order of the lines. May outlive this.
    const std::shared_ptr<bus::LineHistory>& at(std::size_t line) const { return histories_[line]; }

  private:
    void look();

    rt::Clock& clock_;
    std::vector<const bus::LineBus*> lines_;
    std::vector<std::shared_ptr<bus::LineHistory>> histories_;
    std::unique_ptr<rt::Alarm> alarm_;
    TimePoint began_{};
    std::int64_t looks_ = 0;
    bool running_ = false;
};

}  // namespace panelgate::app
