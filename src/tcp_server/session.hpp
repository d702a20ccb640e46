#pragma once

#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "dispatch.hpp"
#include "panelgate/bus/bus_client.hpp"
#include "panelgate/modbus/mbap.hpp"
#include "panelgate/tcp_server/counters.hpp"
#include "panelgate/tcp_server/listener.hpp"
#include "panelgate/tcp_server/settings.hpp"
#include "panelgate/tcp_server/unit_map.hpp"
#include "reply_queue.hpp"

namespace panelgate::tcp_server {

/// What the connections of one listener share; held by the listener and by each of them.
struct Shared {
    Settings settings;
    UnitMap units;
    Hooks hooks;
    Counters counters;
    TimePoint started;

    void log(std::string_view event, std::string_view client, std::string_view more = {}) const;
};

/// One client connection. Its listener keeps it alive until `on_closed`; the operations under way
/// keep it a little longer. One read loop and one write at a time.
class Session : public std::enable_shared_from_this<Session> {
  public:
    using ClosedHandler = std::function<void(const std::shared_ptr<Session>&)>;

    Session(boost::asio::ip::tcp::socket socket, std::string client, std::shared_ptr<Shared> shared,
            ClosedHandler on_closed);

    void start();
    /// Takes no more requests, answers what is outstanding, then closes.
    void finish();
    /// Closes at once and takes its waiting requests back from the buses. May be called twice.
    void close();

  private:
    void read();
    void on_read(const boost::system::error_code& error, std::size_t size);
    void on_end_of_input();
    void watch_for_reset();
    bool take_adus();
    bool skip_protocol();
    void serve(const modbus::Adu& adu);
    void forward(const modbus::Adu& adu, const Target& target);
    void broadcast(const modbus::Adu& adu, const std::vector<bus::BusClient*>& lines);
    void use(bus::BusClient* bus);
    bus::Request make_request(const modbus::Adu& adu, std::uint8_t station) const;
    /// The reply to an open request; nothing: it gets none.
    void settle(ReplyQueue::Ticket ticket, std::optional<Bytes> pdu);

    void guard_partial_adu(bool progress);
    void write();
    void on_written(const boost::system::error_code& error);
    void take_back_waiting();
    void fail(std::string_view reason, bool protocol_error);

    boost::asio::ip::tcp::socket socket_;
    std::string client_name_;
    std::shared_ptr<Shared> shared_;
    ClosedHandler on_closed_;
    bus::ClientId client_ = bus::next_client_id();
    std::set<bus::BusClient*> used_;

    std::array<std::uint8_t, 4096> input_{};
    modbus::MbapFramer framer_;
    int bad_protocol_ids_ = 0;  ///< in a row
    boost::asio::steady_timer partial_timer_;
    std::uint64_t partial_watch_ = 0;  ///< which ADU the timer is for; 0: none
    std::uint64_t partial_watches_ = 0;
    boost::asio::steady_timer grace_timer_;

    ReplyQueue replies_;
    Bytes output_;  ///< the ADU that is being written
    bool writing_ = false;
    bool finishing_ = false;  ///< closes when the last reply has left
    bool closed_ = false;
};

}  // namespace panelgate::tcp_server
