#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/scan/scanner.hpp"
#include "panelgate/sim/misbehaviour.hpp"
#include "panelgate/sim/station.hpp"

namespace panelgate::scan {

inline const profile::Catalogue& shipped() {
    static const profile::Catalogue profiles = profile::Catalogue::shipped();
    return profiles;
}

/// Simulated panels on a line in virtual time, and a scanner that asks them.
class VirtualLine {
  public:
    explicit VirtualLine(const SerialFormat& format = {38400, 8, Parity::none, 1})
        : format_(format), speaks_(format) {}

    sim::Misbehaviour& add(const std::string& profile, std::uint8_t station) {
        return add(*shipped().find(profile), station);
    }
    sim::Misbehaviour& add(const profile::PanelProfile& profile, std::uint8_t station) {
        stations_.emplace_back(profile, station);
        orders_.set(station, profile.crc_order);
        return faults_[station];
    }
    /// Another master's bytes on the line, readable in its own format only.
    void add_foreign(Duration at, const Bytes& bytes) {
        for (std::size_t i = 0; i < bytes.size(); ++i)
            others_.emplace(start + at + wire_time(format_, i + 1), bytes[i]);
    }
    void garble_other_parities() { garbles_ = true; }
    /// Sets the mode of the panels at a remote line's far end, whose format the scanner cannot set.
    void set_panel_mode(SerialMode mode) { format_.mode = mode; }
    void seed(unsigned value) { chance_.seed(value); }
    void echo() { echo_ = true; }
    /// Answers by a function of the request's ADU instead of the stations.
    void answer_by(std::function<Bytes(const Bytes&)> answer) { answer_ = std::move(answer); }

    Result scan(Settings settings, const profile::Catalogue& profiles = shipped()) {
        Scanner scanner(profiles, std::move(settings), start);
        run(scanner, start + 1h);
        return scanner.result();
    }
    /// Runs until the scan is done or the time is up.
    void run(Scanner& scanner, TimePoint until) {
        while (!scanner.done()) {
            while (auto action = scanner.poll_action()) act(*action);
            const TimePoint deadline = scanner.next_deadline().value_or(until);
            if (std::min(deadline, next_byte()) > until) return;
            if (next_byte() <= deadline) {
                hand_over(scanner);
            } else {
                now = std::max(now, deadline);
                scanner.on_deadline(now);
            }
        }
    }

    const TimePoint start{1h};
    TimePoint now = start;
    std::vector<Bytes> sent;
    std::vector<SerialFormat> formats;

  private:
    TimePoint next_byte() const {
        TimePoint next = TimePoint::max();
        if (!coming_.empty()) next = coming_.begin()->first;
        if (!others_.empty()) next = std::min(next, others_.begin()->first);
        return next;
    }
    void hand_over(Scanner& scanner) {
        auto& queue = !coming_.empty() && coming_.begin()->first == next_byte() ? coming_ : others_;
        const auto first = queue.begin();
        now = std::max(now, first->first);
        auto byte = first->second;
        if (&queue == &others_ && speaks_ != format_)
            byte = static_cast<std::uint8_t>(~byte | 0x81);
        queue.erase(first);
        scanner.on_rx(now, Bytes{byte});
    }
    void act(const Action& action) {
        if (const auto* set = std::get_if<SetFormat>(&action)) {
            speaks_ = set->format;
            formats.push_back(speaks_);
            return;
        }
        const Bytes& adu = std::get<Transmit>(action).request.adu();
        if (formats.empty()) speaks_.mode = std::get<Transmit>(action).mode;
        sent.push_back(adu);
        if (echo_) put(now, on_wire(std::get<Transmit>(action)), {});
        transmit(adu);
    }
    void transmit(const Bytes& adu) {
        const TimePoint end = now + frame_time(speaks_, adu.size()) + silent_interval(speaks_);
        sim::Spoken spoken{speaks_.baud == format_.baud ? reply_to(adu) : Bytes(), {}, {}};
        if (speaks_ != format_ && !garbles_) spoken.adu.clear();
        if (const auto faults = faults_.find(adu[0]); faults != faults_.end())
            spoken = sim::misbehave(faults->second, std::move(spoken.adu), chance_, format_);
        if (speaks_ != format_)
            for (std::uint8_t& byte : spoken.adu) byte = static_cast<std::uint8_t>(byte << 1 | 1);
        put(end + 1ms + spoken.delay, spoken.adu, spoken.ends);
    }
    Bytes reply_to(const Bytes& adu) {
        if (answer_) return answer_(adu);
        const ByteView pdu = ByteView(adu).subspan(1, adu.size() - 3);
        for (sim::Station& station : stations_) {
            const modbus::CrcOrder order = orders_.of(station.id());
            if (station.id() == adu[0] && modbus::crc_ok(adu, order))
                return modbus::encode_adu(adu[0], station.handle(now, 0, pdu), order);
        }
        return {};
    }
    void put(TimePoint at, const Bytes& bytes, const std::vector<std::uint32_t>& ends) {
        for (std::size_t i = 0; i < bytes.size(); ++i) {
            const Duration after =
                i < ends.size() ? Duration(1s) * ends[i] / format_.baud : wire_time(format_, i + 1);
            coming_.emplace(at + after, bytes[i]);
        }
    }

    SerialFormat format_;
    SerialFormat speaks_;
    bool garbles_ = false;
    bool echo_ = false;
    std::function<Bytes(const Bytes&)> answer_;
    std::vector<sim::Station> stations_;
    modbus::CrcOrders orders_;
    std::map<std::uint8_t, sim::Misbehaviour> faults_;
    std::multimap<TimePoint, std::uint8_t> coming_;
    std::multimap<TimePoint, std::uint8_t> others_;
    std::mt19937 chance_{1};
};

}  // namespace panelgate::scan
