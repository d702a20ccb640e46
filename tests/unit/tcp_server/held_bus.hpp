#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/bus/bus_client.hpp"

namespace panelgate::tcp_server {

/// A bus that keeps every request until the test answers it, in any order.
class ManualBus : public bus::BusClient {
  public:
    struct Held {
        bus::Request request;
        bus::AnswerHandler handler;
    };

    explicit ManualBus(boost::asio::io_context& context) : context_(context) {}

    void transact(bus::Request request, bus::AnswerHandler handler) override {
        bus::Answer answer;
        answer.refusal = rights.judge(request.station, request.request);
        if (answer.refusal) {
            answer.pdu = bus::answer_to(*answer.refusal, request.request.function());
        } else {
            seen.push_back(request);
            if (instant) answer.pdu = *instant;
        }
        if (answer.refusal || instant) {
            return boost::asio::post(context_,
                                     [handler = std::move(handler), answer] { handler(answer); });
        }
        held.push_back({std::move(request), std::move(handler)});
    }
    void cancel(bus::ClientId client) override {
        cancelled.push_back(client);
        std::deque<Held> kept;
        std::deque<Held> gone;
        for (Held& one : held) (one.request.client == client ? gone : kept).push_back(one);
        held = std::move(kept);
        for (Held& one : gone) one.handler(bus::Answer{});
    }
    void name_client(bus::ClientId client, std::string name) override {
        names[client] = std::move(name);
    }
    bus::LineStatus status() const override { return line; }
    bus::StationStatus station_status(std::uint8_t) const override { return {}; }
    std::optional<bus::Refusal> write_refusal(std::uint8_t station) const override {
        return rights.judge_write(station);
    }
    /// Makes this station read-only.
    void protect(std::uint8_t station) {
        rights = bus::Rights({{station, {"protected", bus::Access::read_only, {}}}});
    }
    bus::TracePart trace(std::size_t) const override { return {}; }

    /// Answers the pending request at `index`.
    void answer(std::size_t index, Result<Bytes> pdu, bool transmitted = true) {
        const Held one = std::move(held.at(index));
        held.erase(held.begin() + static_cast<std::ptrdiff_t>(index));
        bus::Answer answer;
        answer.pdu = std::move(pdu);
        answer.transmitted = transmitted;
        one.handler(answer);
    }

    std::deque<Held> held;
    std::vector<bus::Request> seen;
    std::vector<bus::ClientId> cancelled;
    std::map<bus::ClientId, std::string> names;
    std::optional<Bytes> instant;  ///< if set, the immediate reply to every request
    bus::LineStatus line;
    bus::Rights rights;  ///< all, initially

  private:
    boost::asio::io_context& context_;
};

}  // namespace panelgate::tcp_server
