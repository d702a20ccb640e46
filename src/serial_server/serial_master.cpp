#include "panelgate/serial_server/serial_master.hpp"

#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "conversation.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/line/line.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/tcp_server/dispatch.hpp"

namespace panelgate::serial_server {
namespace {

constexpr const char* kProtocol = "serial";

Units served_by(const tcp_server::UnitMap& map) {
    Units units;
    for (unsigned unit = 1; unit < units.size(); ++unit)
        units[unit] = map.is_listed(static_cast<std::uint8_t>(unit));
    return units;
}

/// True if the exception is the gateway's own: the panel did not answer.
bool is_failure(modbus::ExceptionCode code) {
    using enum modbus::ExceptionCode;
    return code == server_device_busy || code == gateway_path_unavailable ||
           code == gateway_target_failed;
}

/// Both callers of one master share its turns.
WhoRef known_as(const std::string& master) {
    return make_who({.face = Face::serial_master,
                     .name = std::string(kProtocol) + ' ' + master,
                     .listener = master,
                     .standing = Role::operator_,
                     .host = host_number(kProtocol + master)});
}

}  // namespace

class SerialMaster::Core final : public line::Line::Events,
                                 public std::enable_shared_from_this<Core> {
  public:
    Core(rt::Clock& clock, Settings settings, tcp_server::UnitMap units,
         std::unique_ptr<line::Line> line)
        : settings_(std::move(settings)),
          map_(std::move(units)),
          clock_(clock),
          line_(std::move(line)),
          request_caller_(settings_.name, known_as(settings_.name)),
          broadcast_caller_(settings_.name, known_as(settings_.name)),
          conversation_(settings_, served_by(map_)),
          drive_(clock, *line_, conversation_, *this) {}

    void start() { line_->start(*this); }
    void apply(Settings settings, tcp_server::UnitMap units);
    void finish() { conversation_.finish(); }
    bool idle() const { return !conversation_.busy() && open_broadcasts_ == 0; }
    void stop();
    Counters counters() const;

    void on_up() override;
    void on_down(const std::string& why) override;
    void on_bytes(ByteView bytes) override {
        drive_.hear([&](TimePoint now) { conversation_.on_rx(now, bytes); });
    }

    void act(const Ask& ask);
    void act(const ForwardBroadcast& spread);
    void act(const Withdraw&) { request_caller_.withdraw(); }
    void act(const Send& send) { line_->write(send.bytes); }
    void on_deadline(TimePoint now) { conversation_.on_deadline(now); }
    void settled(TimePoint) {}

  private:
    using Pdu = std::optional<Bytes>;
    Pdu reply_of(std::uint8_t function, modbus::ExceptionCode code) const;
    Pdu reply_of(std::uint8_t function, Result<Bytes> pdu) const;
    void refuse(const Ask& ask, const tcp_server::Refuse& refusal);
    void forward(const Ask& ask, tcp_server::Forward forwarding);
    void broadcast(const tcp_server::Broadcast& all);

    Settings settings_;
    tcp_server::UnitMap map_;
    rt::Clock& clock_;
    std::unique_ptr<line::Line> line_;
    tcp_server::Caller request_caller_;
    tcp_server::Caller broadcast_caller_;  ///< for broadcasts, which are not withdrawn
    Conversation conversation_;
    line::Drive<Conversation, Core> drive_;
    std::size_t open_broadcasts_ = 0;  ///< outstanding, on all lines
    bool stopped_ = false;
};

void SerialMaster::Core::apply(Settings settings, tcp_server::UnitMap units) {
    settings_ = std::move(settings);
    map_ = std::move(units);
    conversation_.serve(served_by(map_));
}

void SerialMaster::Core::stop() {
    if (std::exchange(stopped_, true)) return;
    drive_.rest();
    line_->stop();
    request_caller_.withdraw();
    broadcast_caller_.withdraw();
}

Counters SerialMaster::Core::counters() const {
    Counters counters = conversation_.counters();
    counters.master = settings_.name;
    counters.reopens = line_->counters().reopens;
    return counters;
}

void SerialMaster::Core::on_up() {
    rt::log(rt::LogLevel::info, "serial master up",
            {{"master", settings_.name}, {"device", settings_.device.device}});
    drive_.hear([&](TimePoint) { conversation_.on_line_up(); });
}

void SerialMaster::Core::on_down(const std::string& why) {
    rt::log(rt::LogLevel::warn, "serial master down", {{"master", settings_.name}, {"why", why}});
    drive_.hear([&](TimePoint) { conversation_.on_line_down(); });
}

void SerialMaster::Core::act(const Ask& ask) {
    auto decision = tcp_server::decide(ask.adu.station, ask.adu.pdu, settings_.access, map_, false,
                                       request_caller_.who());
    if (auto* forwarding = std::get_if<tcp_server::Forward>(&decision))
        return forward(ask, std::move(*forwarding));
    if (const auto* refusal = std::get_if<tcp_server::Refuse>(&decision))
        return refuse(ask, *refusal);
    // An alias for a broadcast: handled like unit 0.
    if (const auto* all = std::get_if<tcp_server::Broadcast>(&decision)) broadcast(*all);
    conversation_.on_answer(clock_.now(), ask.ticket, std::nullopt);
}

void SerialMaster::Core::act(const ForwardBroadcast& spread) {
    const auto decision = tcp_server::decide(spread.adu.station, spread.adu.pdu, settings_.access,
                                             map_, false, broadcast_caller_.who());
    if (const auto* all = std::get_if<tcp_server::Broadcast>(&decision)) return broadcast(*all);
    const auto* refusal = std::get_if<tcp_server::Refuse>(&decision);
    if (refusal == nullptr) return;
    for (const tcp_server::Target& target : refusal->asked)
        broadcast_caller_.count_refused(target.bus, target.station, spread.adu.pdu);
}

void SerialMaster::Core::broadcast(const tcp_server::Broadcast& all) {
    if (open_broadcasts_ + all.lines.size() > settings_.open_broadcasts) return;
    for (bus::BusClient* line : all.lines) {
        ++open_broadcasts_;
        broadcast_caller_.transact(line, 0, all.request,
                                   [weak = weak_from_this()](const bus::Answer&) {
                                       if (const auto self = weak.lock()) --self->open_broadcasts_;
                                   });
    }
}

void SerialMaster::Core::refuse(const Ask& ask, const tcp_server::Refuse& refusal) {
    for (const tcp_server::Target& target : refusal.asked)
        request_caller_.count_refused(target.bus, target.station, ask.adu.pdu);
    conversation_.on_answer(clock_.now(), ask.ticket, reply_of(ask.adu.pdu[0], refusal.code));
}

void SerialMaster::Core::forward(const Ask& ask, tcp_server::Forward forwarding) {
    request_caller_.transact(
        forwarding.target.bus, forwarding.target.station, std::move(forwarding.request),
        [weak = weak_from_this(), ticket = ask.ticket,
         function = ask.adu.pdu[0]](bus::Answer answer) {
            const auto self = weak.lock();
            if (!self || self->stopped_) return;
            self->drive_.tell([&](TimePoint now) {
                self->conversation_.on_answer(now, ticket,
                                              self->reply_of(function, std::move(answer.pdu)));
            });
        });
}

auto SerialMaster::Core::reply_of(std::uint8_t function, modbus::ExceptionCode code) const -> Pdu {
    if (settings_.on_failure == OnFailure::silence && is_failure(code)) return std::nullopt;
    return modbus::encode_exception(function, code);
}

/// Passes a panel's reply unchanged, including its exceptions.
auto SerialMaster::Core::reply_of(std::uint8_t function, Result<Bytes> pdu) const -> Pdu {
    if (!pdu) return reply_of(function, modbus::to_exception(pdu.error()));
    if (pdu->empty() || pdu->size() > modbus::kMaxPdu)
        return reply_of(function, modbus::to_exception(Fault::malformed));
    return std::move(*pdu);
}

SerialMaster::SerialMaster(rt::Clock& clock, Settings settings, tcp_server::UnitMap units,
                           std::unique_ptr<line::Line> line)
    : core_(std::make_shared<Core>(clock, std::move(settings), std::move(units), std::move(line))) {
}

SerialMaster::~SerialMaster() { core_->stop(); }

void SerialMaster::start() { core_->start(); }
void SerialMaster::apply(Settings settings, tcp_server::UnitMap units) {
    core_->apply(std::move(settings), std::move(units));
}
void SerialMaster::finish() { core_->finish(); }
bool SerialMaster::idle() const { return core_->idle(); }
void SerialMaster::stop() { core_->stop(); }
Counters SerialMaster::counters() const { return core_->counters(); }

}  // namespace panelgate::serial_server
