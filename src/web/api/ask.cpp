#include "ask.hpp"

#include <boost/asio/associated_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/system/system_error.hpp>
#include <cstdint>
#include <utility>

#include "answer.hpp"
#include "panelgate/modbus/request.hpp"

namespace panelgate::web {
namespace asio = boost::asio;
namespace {

/// Starts a transaction and resumes the coroutine by post: a bus must not find itself called again
/// from inside its own completion.
struct StartTransact {
    template <class Handler>
    void operator()(Handler handler, bus::BusClient* bus, bus::Request request) const {
        auto shared = std::make_shared<Handler>(std::move(handler));
        bus->transact(std::move(request), [shared](bus::Answer answer) {
            const auto executor = asio::get_associated_executor(*shared);
            asio::post(executor, [shared, answer = std::move(answer)]() mutable {
                (std::move(*shared))(std::move(answer));
            });
        });
    }
};

asio::awaitable<bus::Answer> start_transact(bus::BusClient* bus, bus::Request request) {
    return asio::async_initiate<const asio::use_awaitable_t<>, void(bus::Answer)>(
        StartTransact{}, asio::use_awaitable, bus, std::move(request));
}

}  // namespace

Parsed<bus::Request> request_to(std::uint8_t station, Bytes pdu) {
    auto request = modbus::Request::make(std::move(pdu), modbus::QuantityCheck::wide);
    if (!request) return problem_of(request.error(), false);
    return bus::Request{.station = station, .request = std::move(*request)};
}

void introduce(Caller& caller, bus::BusClient* bus) {
    const bus::ClientId client = caller.id();
    caller.at_leaving(bus, [bus, client] { bus->cancel(client); });
    bus->name_client(client, caller.name());
}

asio::awaitable<bus::Answer> ask(std::shared_ptr<Caller> caller, bus::BusClient* bus,
                                 bus::Request request) {
    if (caller->has_hung_up() && !caller->has_left()) co_return bus::Answer{};  // cancelled
    if (!caller->has_left()) {
        const bool changes = !request.request.is_read();
        introduce(*caller, bus);
        request.client = caller->id();
        if (!caller->address().empty()) request.host = bus::host_of(caller->address());
        asio::awaitable<bus::Answer> pending = start_transact(bus, std::move(request));
        bus::Answer answer = co_await std::move(pending);
        answer.transactions.for_each(
            [&](std::uint64_t number) { caller->add_cost({bus, number}); });
        if (answer.transmitted && changes) caller->take_effect();
        if (!caller->has_left()) co_return answer;
    }
    throw boost::system::system_error(asio::error::operation_aborted);
}

}  // namespace panelgate::web
