#include "northbound.hpp"

#include <utility>

namespace panelgate::app {

Northbound::Northbound(boost::asio::any_io_executor executor, rt::Clock& clock)
    : executor_(std::move(executor)), clock_(clock) {}

void Northbound::show(const std::shared_ptr<const Scene>& scene) {
    if (session_ && session_->fits(*scene)) return session_->show(scene);
    std::unique_ptr<BrokerSession> next;
    if (scene->config->mqtt) next = std::make_unique<BrokerSession>(executor_, clock_, scene);
    if (session_ && next) next->take_over(*session_);
    leave();
    session_ = std::move(next);
    if (session_ && running_) session_->start();
}

void Northbound::start() {
    running_ = true;
    if (session_) session_->start();
}

void Northbound::stop() {
    running_ = false;
    leave();
}

void Northbound::leave() {
    auto leaving = session_ ? session_->stop() : nullptr;
    if (leaving) leaving_ = std::move(leaving);
}

void Northbound::on_bus_event(const std::string& line, const bus::BusEvent& event) {
    if (session_) session_->on_bus_event(line, event);
}

void Northbound::on_points(const Station& station, const std::vector<std::size_t>& wants) {
    if (session_) session_->on_points(station, wants);
}

std::optional<mqtt::Counters> Northbound::counters() const {
    if (!session_) return std::nullopt;
    return session_->counters();
}

}  // namespace panelgate::app
