#include "openings.hpp"

#include <boost/system/errc.hpp>

#include "panelgate/base/endpoint_text.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::app {
namespace {

using boost::system::error_code;
namespace errc = boost::system::errc;

constexpr std::uint16_t kFirstFreePort = 1024;  // below, a right is needed

std::string where(const Door& door) { return endpoint_text(door.address, door.port); }

std::string words(const error_code& why) {
    if (why == errc::address_not_available) return "this machine does not have the address yet";
    return why.message();
}

void tell_wait(const Door& door, const error_code& why) {
    rt::log(rt::LogLevel::warn, "listener waits", {{door.kind, where(door)}, {"why", words(why)}});
}

}  // namespace

Openings::Openings(rt::Clock& clock) : clock_(clock), again_(clock.make_alarm()) {}

void Openings::open(const std::vector<Door>& doors) {
    std::vector<Waiting> late;
    for (const Door& door : doors) {
        const error_code why = opened(door);
        if (!why) continue;
        if (why != errc::address_not_available) {
            const std::string advice = listening_advice(why, door.port);
            throw CannotListen("cannot listen on " + where(door) + ": " + why.message() +
                               (advice.empty() ? "" : "; " + advice));
        }
        tell_wait(door, why);
        late.push_back({door, why});
    }
    waiting_.insert(waiting_.end(), late.begin(), late.end());
    later();
}

void Openings::take_over(const std::vector<Door>& doors) {
    for (const Door& door : doors) waiting_.push_back({door, {}});
    try_again();
}

void Openings::forget(const void* whose) {
    std::erase_if(waiting_, [&](const Waiting& waiting) { return waiting.door.whose == whose; });
    std::erase_if(standing_, [&](const auto& standing) { return standing.first == whose; });
}

error_code Openings::opened(const Door& door) {
    const error_code error = door.open();
    if (error) return error;
    const std::string place = endpoint_text(door.address, door.opened_port());
    rt::log(rt::LogLevel::info, "listening", {{door.kind, place}});
    standing_.emplace_back(door.whose, door.kind + ' ' + place);
    return error;
}

std::string Openings::standing() const {
    std::string text;
    for (const auto& [whose, place] : standing_) text += (text.empty() ? "" : ", ") + place;
    return text;
}

/// The gateway serves meanwhile: nothing that happens here ends it any more.
void Openings::try_again() {
    for (Waiting& waiting : waiting_) {
        const error_code why = opened(waiting.door);
        if (why && why != waiting.why) tell_wait(waiting.door, why);
        waiting.why = why;
    }
    later();
}

void Openings::later() {
    std::erase_if(waiting_, [](const Waiting& waiting) { return !waiting.why; });
    if (!waiting_.empty()) again_->arm(clock_.now() + kPause, [this] { try_again(); });
}

void Openings::stop() {
    again_->cancel();
    waiting_.clear();
    standing_.clear();
}

std::string Openings::missing() const {
    std::string text;
    for (const auto& [door, why] : waiting_) {
        if (!text.empty()) text += ", ";
        text += door.kind + ' ' + where(door) + " (" + words(why) + ')';
    }
    return text;
}

std::string listening_advice(const boost::system::error_code& why, std::uint16_t port) {
    const std::string number = std::to_string(port);
    if (why == errc::permission_denied && port < kFirstFreePort) {
        return "ports below 1024 want CAP_NET_BIND_SERVICE (deploy/systemd gives it; or: setcap "
               "cap_net_bind_service=+ep on the program), or sysctl "
               "net.ipv4.ip_unprivileged_port_start=" +
               number + ", or a port from 1024 on";
    }
    if (why == errc::address_in_use)
        return "another program listens there: ss -ltnp 'sport = :" + number + "' tells which";
    if (why == errc::address_family_not_supported) return "IPv6 is off on this machine";
    return {};
}

}  // namespace panelgate::app
