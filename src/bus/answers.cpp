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

}  // namespace panelgate::bus
