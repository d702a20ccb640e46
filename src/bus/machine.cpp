#include "machine.hpp"

#include "panelgate/arbiter/arbiter.hpp"
#include "panelgate/ethernet/ethernet.hpp"

namespace panelgate::bus {

namespace {

template <class Core>
class MachineOf final : public Machine {
  public:
    explicit MachineOf(const arbiter::Settings& settings) : core_(settings) {}

    void apply(arbiter::Settings settings) override { core_.apply(std::move(settings)); }
    void suspend() override { core_.suspend(); }
    bool is_waiting() const override { return core_.is_waiting(); }
    TimePoint clear_at(TimePoint now) const override { return core_.clear_at(now); }
    void rest_until(TimePoint until) override { core_.rest_until(until); }
    void on_line_left() override { core_.on_line_left(); }
    Result<arbiter::Ticket> submit(TimePoint now, Job job) override {
        return core_.submit(now, std::move(job));
    }
    void deny(TimePoint now, const arbiter::JobQueue::Test& match) override {
        core_.deny(now, match);
    }
    void cancel(TimePoint now, arbiter::Client client) override { core_.cancel(now, client); }
    void on_rx(TimePoint now, ByteView bytes) override { core_.on_rx(now, bytes); }
    void on_deadline(TimePoint now) override { core_.on_deadline(now); }
    void on_line_up(TimePoint now) override { core_.on_line_up(now); }
    void on_line_down(TimePoint now) override { core_.on_line_down(now); }
    void set_latency(Duration latency) override { core_.set_latency(latency); }
    void set_lead(Duration lead) override { core_.set_lead(lead); }
    void confirm_ends(bool confirm) override { core_.confirm_ends(confirm); }
    bool wants_end(TimePoint now) const override { return core_.wants_end(now); }
    void on_end(TimePoint now, Duration left) override { core_.on_end(now, left); }
    bool is_unheard(TimePoint now) const override { return core_.is_unheard(now); }
    std::optional<arbiter::Action> poll_action() override { return core_.poll_action(); }
    std::optional<TimePoint> next_deadline() const override { return core_.next_deadline(); }
    std::optional<TimePoint> busy_until() const override { return core_.busy_until(); }
    std::size_t queue_depth() const override { return core_.queue_depth(); }
    bool idle() const override { return core_.idle(); }
    const arbiter::LineCounters& counters() const override { return core_.counters(); }
    const std::map<std::uint8_t, arbiter::StationCounters>& station_counters() const override {
        return core_.station_counters();
    }
    arbiter::StationHealth health(std::uint8_t id) const override { return core_.health(id); }
    Condition condition(std::uint8_t id) const override { return core_.condition(id); }
    const arbiter::BusShares& shares() const override { return core_.shares(); }
    EchoState echo() const override { return core_.echo(); }

  private:
    Core core_;
};

}  // namespace

std::unique_ptr<Machine> make_machine(const arbiter::Settings& settings) {
    if (settings.in_flight > 0) return std::make_unique<MachineOf<ethernet::Ethernet>>(settings);
    return std::make_unique<MachineOf<arbiter::Arbiter>>(settings);
}

}  // namespace panelgate::bus
