#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "panelgate/bus/bus.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/gateway/running_line.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/rt/process.hpp"
#include "panelgate/standby/seat.hpp"
#include "panelgate/web/api/sources.hpp"

namespace panelgate::gateway {

/// Decides which serial lines this box drives while another box shares them, and carries out what
/// their seats want. Lines over TCP have no seat: a device server's only connection is their lock,
/// and Modbus/TCP devices need none. An object of the plant's loop.
class Standby {
  public:
    struct Hooks {
        /// The running line of this name; null: there is none.
        std::function<RunningLine*(const std::string& line)> line;
        /// A role has changed: arrange() has another result. Called from the loop.
        std::function<void()> rearrange;
        /// For log, journal and events.
        std::function<void(const std::string& line, const standby::Seat& seat)> tell;
    };
    /// The executor and the clock outlive it.
    Standby(boost::asio::any_io_executor executor, rt::Clock& clock, Hooks hooks);
    ~Standby();
    Standby(const Standby&) = delete;
    Standby& operator=(const Standby&) = delete;

    /// Takes a configuration; lines that stay keep their seats.
    void apply(const config::Config& config);
    void stop();
    /// The configuration as this box serves it now: lines without the master's role are listened
    /// to; a box without any such role tells no broker and no webhook.
    std::shared_ptr<const config::Config> arrange(
        const std::shared_ptr<const config::Config>& config) const;

    /// Asked before each frame of a driven line. False: the frame must not be sent.
    bool may_send(const std::string& line);
    void on_event(const std::string& line, const bus::BusEvent& event);

    /// The lines run as arrange() has said.
    void arranged();
    /// For REST.
    web::StandbyView view() const;

  private:
    struct Place {
        standby::Seat seat;
        config::Line line;                        ///< as configured, without its points
        std::optional<std::uint64_t> received{};  ///< bytes at the last look; empty: none yet
        TimePoint opens_by{};  ///< until then a line that is not up may be opening
        std::unique_ptr<bus::Bus> probe{};
        bool asked = false;                   ///< the probe's read is on its way
        std::size_t probed = 0;               ///< index of the station that the probe asks
        std::size_t tried = 0;                ///< probes without an answer, one after another
        TimePoint answered{};                 ///< the last look at which a panel was online
        EchoState echo = EchoState::unknown;  ///< of the driven line at the last look
    };

    void look();
    void look_at_locks();
    void look_for_device(const std::string& name, Place& place);
    void listen_to(const std::string& name, Place& place);
    void look_for_echo(const std::string& name, Place& place);
    void carry_out(const std::string& name, Place& place, std::optional<standby::Deed> deed);
    void begin_probe(const std::string& name, Place& place);
    void ask_panel(const std::string& name, Place& place);
    void end_probe(const std::string& name, Place& place, bool answered);
    void keep_alive(const std::string& name, Place& place);
    void look_for_answers(const std::string& name, Place& place);
    std::size_t station_to_probe(const std::string& name, const Place& place) const;
    void change(const std::string& name, Place& place);
    void ask_peer();
    void take_peer(const std::string& text);

    boost::asio::any_io_executor executor_;
    rt::Clock& clock_;
    Hooks hooks_;
    std::unique_ptr<rt::Alarm> alarm_;
    std::optional<standby::Settings> settings_;
    std::map<std::string, Place> places_;  ///< by line
    /// Lines over TCP, which a device server locks: whether this box has the connection, since
    /// when.
    std::map<std::string, std::pair<bool, TimePoint>> locks_;
    std::string peer_role_;  ///< as the peer says; "": it says nothing
    TimePoint next_question_{};
    bool asking_ = false;
    std::unique_ptr<rt::Worker> worker_;
    std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace panelgate::gateway
