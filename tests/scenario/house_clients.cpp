#include "house_clients.hpp"

#include <algorithm>
#include <string>
#include <utility>

namespace panelgate::scenario {

namespace {

constexpr std::size_t kHeader = 7;  // MBAP

}  // namespace

void HouseClients::start() {
    for (const ClientPlan& plan : plan_.line.clients) {
        Client& client = clients_.emplace_back();
        client.plan = plan;
        connect(client);
        for (unsigned i = 0; i < plan.in_flight; ++i)
            agenda_.at(agenda_.now(), [this, &client] { ask(client); });
        if (plan.leaves > 0) leave_some_time(client);
    }
}

bool HouseClients::idle() const {
    return std::ranges::all_of(clients_, [](const Client& c) { return c.open.empty(); });
}

void HouseClients::connect(Client& client) {
    const std::uint64_t host = client.plan.host != 0 ? client.plan.host : 1000 + connections_;
    const std::string name = "client " + std::to_string(++connections_);
    tcp_server::Caller caller(
        name, make_who({.face = Face::modbus_tcp, .name = "modbus_tcp " + name, .host = host}));
    client.pipeline = std::make_shared<tcp_server::Pipeline>(
        shared_, std::move(caller), [this, &client] { take_soon(client); });
}

void HouseClients::ask(Client& client) {
    if (ended_) return;
    reach_([this, &client] {
        if (!client.pipeline->has_room()) return;
        const std::uint8_t unit = draw_unit(client);
        const bool write = unit == 0 || random_.chance(client.plan.writes);
        const Bytes pdu = write ? questions_.write() : draw_read(client);
        if (write) judge_.allow_write(unit, pdu);
        client.open.push_back({judge_.ask(unit, pdu), ++client.transaction});
        agenda_.tell("client asks unit " + std::to_string(unit), pdu);
        client.pipeline->take({client.transaction, unit, pdu});
        take_soon(client);  // what is refused at once is there without being told
    });
}

void HouseClients::take_soon(Client& client) {
    if (client.pipeline->front() == nullptr || std::exchange(client.taking, true)) return;
    agenda_.at(agenda_.now() + random_.between(0us, plan_.take),
               [this, &client] { reach_([this, &client] { take(client); }); });
}

/// All that is there: then each place is free for another question.
void HouseClients::take(Client& client) {
    client.taking = false;
    while (const Bytes* adu = client.pipeline->front()) {
        judge(client, *adu);
        client.pipeline->pop();
        const TimePoint next = agenda_.now() + random_.between(1us, client.plan.pause + 1us);
        agenda_.at(next, [this, &client] { ask(client); });
        if (random_.chance(client.plan.vanish)) return leave(client);
    }
}

void HouseClients::judge(Client& client, const Bytes& adu) {
    if (client.open.empty()) return judge_.fail("a reply that nobody asked for");
    const Asked asked = std::move(client.open.front());
    client.open.pop_front();
    agenda_.tell("client is answered", adu);
    const HouseJudge::Question& question = asked.question;
    const ByteView pdu = ByteView(adu).subspan(kHeader);
    const bool own = word(adu, 0) == asked.transaction && adu[kHeader - 1] == question.station &&
                     (pdu[0] & 0x7F) == question.pdu[0];
    if (!own) return judge_.fail("a reply that is not the next one's");
    if ((pdu[0] & 0x80) != 0) return;
    const auto max_age = judge_.max_age(question.station);
    judge_.judge(question, {pdu.begin(), pdu.end()},
                 max_age ? std::optional(question.at - *max_age) : std::nullopt);
}

/// And comes back as another one.
void HouseClients::leave(Client& client) {
    const std::size_t open = client.open.size();
    client.open.clear();
    client.pipeline->close();
    connect(client);
    for (std::size_t i = 0; i < open; ++i)
        agenda_.at(agenda_.now() + 1us, [this, &client] { ask(client); });
}

void HouseClients::leave_some_time(Client& client) {
    const std::chrono::duration<double> mean(1 / client.plan.leaves);
    const Duration wait = random_.between(0us, std::chrono::duration_cast<Duration>(2 * mean));
    agenda_.at(agenda_.now() + wait, [this, &client] {
        if (ended_) return;
        reach_([this, &client] { leave(client); });
        leave_some_time(client);
    });
}

std::uint8_t HouseClients::draw_unit(Client& client) {
    if (client.plan.scans) return static_cast<std::uint8_t>(client.scanned++ % 247 + 1);
    if (random_.chance(client.plan.broadcasts)) return 0;
    const auto count = static_cast<unsigned>(client.plan.stations.size());
    return client.plan.stations[random_.below(count)];
}

Bytes HouseClients::draw_read(const Client& client) {
    if (client.plan.scans) return Writer().u8(3).u16(0).u16(1).take();
    return questions_.read();
}

}  // namespace panelgate::scenario
