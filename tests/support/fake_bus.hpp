#pragma once

#include <algorithm>
#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/post.hpp>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/bus/bus_client.hpp"

namespace panelgate::test {

/// A bus that answers from a function, by post; whoever asks is found in `requests`. When the
/// function gives nothing the request stays open until release() or cancel().
class FakeBus : public bus::BusClient {
  public:
    using Script = std::function<std::optional<bus::Answer>(const bus::Request&)>;

    explicit FakeBus(boost::asio::any_io_executor executor) : executor_(std::move(executor)) {}

    void transact(bus::Request request, bus::AnswerHandler handler) override {
        if (auto refusal = rights.judge(request.station, request.request)) {
            bus::Answer refused;
            refused.pdu = bus::answer_to(*refusal, request.request.function());
            refused.refusal = std::move(refusal);
            return settle(std::move(handler), std::move(refused));
        }
        requests.push_back(request);
        auto answer = script ? script(request) : fault(Fault::timeout, true);
        if (answer) {
            settle(std::move(handler), std::move(*answer));
        } else {
            open_.emplace_back(request.client, std::move(handler));
        }
    }

    void count_refused(std::uint8_t, ByteView, const WhoRef&) override { ++told_refused; }

    void cancel(bus::ClientId client) override {
        cancelled.push_back(client);
        std::vector<Open> kept;
        for (Open& open : std::exchange(open_, {})) {
            if (open.first == client && completes_on_cancel) {
                settle(std::move(open.second), fault(Fault::cancelled, false));
            } else {
                kept.push_back(std::move(open));
            }
        }
        open_ = std::move(kept);
    }

    /// Answers every open request.
    void release(const bus::Answer& answer) {
        for (Open& open : std::exchange(open_, {})) settle(std::move(open.second), answer);
    }
    std::size_t open() const { return open_.size(); }

    bus::LineStatus status() const override { return line; }
    bus::StationStatus station_status(std::uint8_t station) const override {
        const auto found = stations.find(station);
        return found == stations.end() ? bus::StationStatus{} : found->second;
    }
    std::optional<bus::Refusal> write_refusal(std::uint8_t station) const override {
        return rights.judge_write(station);
    }
    bus::TracePart trace(std::size_t most) const override {
        return {last(frames, most), last(made, most), last(exchanges, most)};
    }
    bus::TracePart trace_since(std::uint64_t sequence, std::size_t most) const override {
        return {since(frames, sequence, most), since(made, sequence, most),
                since(exchanges, sequence, most)};
    }
    std::vector<bus::IncidentHead> incidents() const override {
        std::vector<bus::IncidentHead> heads;
        for (const bus::Incident& one : frozen) heads.push_back(one.head);
        return heads;
    }
    std::optional<bus::Incident> incident(std::uint64_t id) override {
        for (bus::Incident& one : frozen) {
            if (one.head.id != id) continue;
            one.head.read = true;
            return one;
        }
        return std::nullopt;
    }
    std::vector<bus::ClientShare> clients() const override { return shares; }
    void name_client(bus::ClientId client, std::string name) override {
        names[client] = std::move(name);
    }

    static bus::Answer reply(Bytes pdu) {
        return {Result<Bytes>(std::move(pdu)), true, bus::Source::bus, {}};
    }
    static bus::Answer fault(Fault fault, bool transmitted) {
        return {Result<Bytes>(fault), transmitted, bus::Source::bus, {}};
    }

    Script script;
    std::vector<bus::Request> requests;
    std::vector<bus::ClientId> cancelled;
    bool completes_on_cancel = true;  ///< what is open waits; false: it is on the wire
    int told_refused = 0;
    bus::LineStatus line{"floor1", "/dev/ttyUSB0", true, "up", 0, 0, EchoState::absent};
    bus::Rights rights;  ///< to everything, at first
    std::vector<bus::ClientShare> shares;
    std::map<bus::ClientId, std::string> names;
    std::map<std::uint8_t, bus::StationStatus> stations;
    std::vector<bus::TraceFrame> frames;
    std::vector<bus::TraceDecision> made;  ///< decisions
    std::vector<bus::TraceTransaction> exchanges;
    std::vector<bus::Incident> frozen;

  private:
    template <class Entry>
    static std::vector<Entry> last(const std::vector<Entry>& all, std::size_t most) {
        const auto skip = all.size() - std::min(most, all.size());
        return {all.begin() + static_cast<std::ptrdiff_t>(skip), all.end()};
    }
    template <class Entry>
    static std::vector<Entry> since(const std::vector<Entry>& all, std::uint64_t sequence,
                                    std::size_t most) {
        std::vector<Entry> found;
        for (const Entry& entry : all) {
            if (entry.sequence > sequence && found.size() < most) found.push_back(entry);
        }
        return found;
    }
    using Open = std::pair<bus::ClientId, bus::AnswerHandler>;

    void settle(bus::AnswerHandler handler, bus::Answer answer) {
        boost::asio::post(executor_, [handler = std::move(handler), answer = std::move(answer)] {
            handler(answer);
        });
    }

    boost::asio::any_io_executor executor_;
    std::vector<Open> open_;
};

}  // namespace panelgate::test
