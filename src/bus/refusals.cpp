#include "refusals.hpp"

#include <boost/asio/post.hpp>
#include <utility>

namespace panelgate::bus {
namespace {

constexpr auto kPause = 1ms;

void hand_all(const std::vector<std::function<void()>>& waiting) {
    for (const auto& hand_over : waiting) hand_over();
}

}  // namespace

Refusals::Refusals(boost::asio::any_io_executor executor, rt::Clock& clock)
    : executor_(std::move(executor)), clock_(clock), alarm_(clock.make_alarm()) {}

Refusals::~Refusals() {
    if (waiting_.empty()) return;
    boost::asio::post(executor_, [waiting = std::move(waiting_)] { hand_all(waiting); });
}

void Refusals::add(std::function<void()> hand_over) {
    waiting_.push_back(std::move(hand_over));
    if (waiting_.size() > 1) return;
    alarm_->arm(clock_.now() + kPause, [this] { hand_all(std::exchange(waiting_, {})); });
}

}  // namespace panelgate::bus
