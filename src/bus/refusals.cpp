#include "refusals.hpp"

#include <boost/asio/post.hpp>
#include <utility>

namespace panelgate::bus {
namespace {

constexpr auto kPause = 1ms;

void hand_all(std::vector<Handed> waiting) {
    for (Handed& one : waiting) one.handler(std::move(one.answer));
}

}  // namespace

Refusals::Refusals(boost::asio::any_io_executor executor, rt::Clock& clock)
    : executor_(std::move(executor)), clock_(clock), alarm_(clock.make_alarm()) {}

Refusals::~Refusals() {
    if (waiting_.empty()) return;
    boost::asio::post(executor_,
                      [waiting = std::move(waiting_)]() mutable { hand_all(std::move(waiting)); });
}

void Refusals::add(Handed refused) {
    waiting_.push_back(std::move(refused));
    if (waiting_.size() > 1) return;
    alarm_->arm(clock_.now() + kPause, [this] { hand_all(std::exchange(waiting_, {})); });
}

}  // namespace panelgate::bus
