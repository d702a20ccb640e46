#include "answers.hpp"

#include <boost/asio/post.hpp>
#include <utility>

namespace panelgate::bus {

Answers::Answers(boost::asio::any_io_executor executor)
    : executor_(std::move(executor)), waiting_(std::make_shared<Waiting>()) {}

void Answers::add(Handed handed, bool soon) {
    waiting_->next.push_back(std::move(handed));
    if ((soon && waiting_->leaving.empty()) || std::exchange(waiting_->posted, true)) return;
    boost::asio::post(executor_, [waiting = waiting_] {
        waiting->posted = false;
        waiting->hand_over();
    });
}

void Answers::hand_over() {
    const std::shared_ptr<Waiting> waiting = waiting_;  // a handler may end this
    waiting->hand_over();
}

/// A handler may hold the last of its owner: it ends before the next one is called.
void Answers::Waiting::hand_over() {
    if (!leaving.empty()) return;
    leaving.swap(next);
    for (Handed& one : leaving) {
        Handed now = std::move(one);
        now.handler(std::move(now.answer));
    }
    leaving.clear();
}

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
