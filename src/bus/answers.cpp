#include "answers.hpp"

#include <boost/asio/post.hpp>
#include <utility>

namespace panelgate::bus {

Answers::Answers(boost::asio::any_io_executor executor)
    : executor_(std::move(executor)), waiting_(std::make_shared<Waiting>()) {}

void Answers::add(Delivery delivery, bool soon) {
    waiting_->next.push_back(std::move(delivery));
    if ((soon && waiting_->delivering.empty()) || std::exchange(waiting_->posted, true)) return;
    boost::asio::post(executor_, [waiting = waiting_] {
        waiting->posted = false;
        waiting->deliver();
    });
}

void Answers::deliver() {
    const std::shared_ptr<Waiting> waiting = waiting_;  // a handler may destroy this
    waiting->deliver();
}

/// A handler may own the last reference to its owner: it is destroyed before the next is called.
void Answers::Waiting::deliver() {
    if (!delivering.empty()) return;
    delivering.swap(next);
    for (Delivery& one : delivering) {
        Delivery now = std::move(one);
        now.handler(std::move(now.answer));
    }
    delivering.clear();
}

namespace {

constexpr auto kPause = 1ms;

void deliver_all(std::vector<Delivery> waiting) {
    for (Delivery& one : waiting) one.handler(std::move(one.answer));
}

}  // namespace

Refusals::Refusals(boost::asio::any_io_executor executor, rt::Clock& clock)
    : executor_(std::move(executor)), clock_(clock), alarm_(clock.make_alarm()) {}

Refusals::~Refusals() {
    if (waiting_.empty()) return;
    boost::asio::post(
        executor_, [waiting = std::move(waiting_)]() mutable { deliver_all(std::move(waiting)); });
}

void Refusals::add(Delivery refused) {
    waiting_.push_back(std::move(refused));
    if (waiting_.size() > 1) return;
    alarm_->arm(clock_.now() + kPause, [this] { deliver_all(std::exchange(waiting_, {})); });
}

}  // namespace panelgate::bus
