#include "answers.hpp"

#include <boost/asio/post.hpp>
#include <utility>

namespace panelgate::bus {

Answers::Answers(boost::asio::any_io_executor executor)
    : executor_(std::move(executor)), waiting_(std::make_shared<Waiting>()) {}

void Answers::add(Handed handed) {
    waiting_->next.push_back(std::move(handed));
    if (std::exchange(waiting_->posted, true)) return;
    boost::asio::post(executor_, [waiting = waiting_] { waiting->hand_over(); });
}

/// A handler may hold the last of its owner: it ends before the next one is called.
void Answers::Waiting::hand_over() {
    posted = false;
    leaving.swap(next);
    for (Handed& one : leaving) {
        Handed now = std::move(one);
        now.handler(std::move(now.answer));
    }
    leaving.clear();
}

}  // namespace panelgate::bus
