#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/explain/doors.hpp"
#include "panelgate/gateway/alarm_desk.hpp"
#include "panelgate/gateway/alarm_hook.hpp"
#include "panelgate/gateway/audit_book.hpp"
#include "panelgate/gateway/certificates.hpp"
#include "panelgate/gateway/discoveries.hpp"
#include "panelgate/gateway/findings.hpp"
#include "panelgate/gateway/images.hpp"
#include "panelgate/gateway/journal.hpp"
#include "panelgate/gateway/northbound.hpp"
#include "panelgate/gateway/running_line.hpp"
#include "panelgate/gateway/servers.hpp"
#include "panelgate/gateway/snapshot.hpp"
#include "panelgate/gateway/standby.hpp"
#include "panelgate/metrics/exposition.hpp"
#include "panelgate/points/relays.hpp"
#include "panelgate/rt/asio_clock.hpp"
#include "panelgate/rt/process.hpp"
#include "panelgate/web/api/server.hpp"
#include "panelgate/web/http/event_hub.hpp"

namespace panelgate::gateway {

class Reloader;

/// The composition root: builds the gateway from a configuration, and changes it when a reload
/// brings a new one. An object of the plant's loop.
class Gateway {
  public:
    /// `reloads` serves the reload requests of REST, `text` those about the configuration's text.
    /// Both outlive this, as both loops do.
    Gateway(web::Loops loops, std::shared_ptr<const config::Config> config, bool simulate,
            Reloader* reloads, web::TextSource* text = nullptr);
    ~Gateway();
    Gateway(const Gateway&) = delete;
    Gateway& operator=(const Gateway&) = delete;

    /// Opens lines and listeners. Throws CannotListen if a listener cannot be opened; one whose
    /// address does not exist yet is opened later.
    void start();
    /// Serves this configuration from now on; unchanged lines, listeners, clients and points are
    /// not disturbed. Throws CannotListen, or std::system_error without a pty for a simulated line;
    /// then nothing has changed. Unchanged stations share their profile with the running stations
    /// (config::share_profiles()).
    void apply(std::shared_ptr<const config::Config> config);
    /// Records a reload, whatever became of it, and keeps the audit as it now is configured.
    void record(const web::ReloadVerdict& verdict);
    const std::shared_ptr<const config::Config>& config() const { return configured_; }
    /// The certificates in use, which may be newer than the configuration's.
    std::vector<ServedCertificate> certificates() const;
    /// Stops accepting; accepted requests are answered within their deadline.
    void stop_accepting();
    /// True when no client's answer is outstanding and the broker knows of the end.
    bool drained();
    /// Connections with outstanding answers, once nothing more is accepted.
    std::size_t pending_connections() const { return servers_.pending_connections(); }
    /// The longest time that an accepted request may take to its answer.
    Duration longest_answer() const;
    /// The status text for the service manager.
    std::string status() const;
    Journal& journal() { return journal_; }
    /// Closes everything.
    void stop();

    std::uint16_t http_port() const { return servers_.http_port(); }
    std::uint16_t modbus_port() const { return servers_.modbus_port(); }

  private:
    using Lines = std::vector<std::shared_ptr<RunningLine>>;

    /// For one of so many lines.
    LineWatch watch(std::size_t lines);
    void on_event(const std::string& line, const bus::BusEvent& event);
    void on_points(const std::string& line, std::uint8_t station,
                   const std::vector<std::size_t>& wants);
    void on_alarm(const alarms::Change& change);
    void on_finding(const web::Finding& finding, bool is_new);
    Lines lines_of(const config::Config& config);
    std::function<std::string()> shown() const;
    void serve(std::shared_ptr<const config::Config> config);
    RunningLine* find_running(const std::string& line);
    /// Another webhook is told what is active.
    void apply_alarms();
    void tell_role(const std::string& line, const standby::Seat& seat);
    void apply_lines(const config::Config& config, const Lines& lines);
    void rest_wires(const config::Config& config, const Lines& lines);
    void retire_lines(const Lines& lines);
    void show(const std::shared_ptr<Snapshot>& snapshot);
    web::Providers providers();
    void watch_certificates();
    void watch_expiry();
    void ask_broker();
    void judge_waiting();
    void look_for_findings();
    Findings::State state() const;
    std::vector<web::LineUsage> usage() const;
    const std::vector<web::Finding>& findings();
    metrics::Snapshot figures();
    std::function<std::string()> metrics_text();

    web::Loops loops_;
    rt::AsioClock clock_;
    rt::LoopLag lag_{clock_};
    AuditBook audit_{loops_.plant, clock_};  ///< lines record in it until they are destroyed
    Journal journal_{loops_.plant, clock_};  ///< lines tell it until they are destroyed
    AlarmHook hook_{loops_.plant, clock_};
    AlarmDesk alarms_{clock_, journal_,
                      [this]() -> const std::vector<web::Finding>& { return findings(); },
                      [this](const alarms::Change& change) { on_alarm(change); },
                      [this](const alarms::Settings& alarm, const alarms::Status& status) {
                          northbound_.on_alarm(alarm, status);
                      }};
    explain::Doors doors_;  ///< lines ask it until they are destroyed
    bool simulate_;
    Reloader* reloads_;
    web::TextSource* text_;
    web::EventOutlet events_;  ///< buses publish by it until they are destroyed
    /// As the file says; the snapshot's is arranged to what this box drives now.
    std::shared_ptr<const config::Config> configured_;
    Standby standby_{
        loops_.plant,
        clock_,
        {[this](const std::string& line) { return find_running(line); },
         [this] { serve(standby_.arrange(configured_)); },
         [this](const std::string& line, const standby::Seat& seat) { tell_role(line, seat); }}};
    /// The current snapshot, never null.
    std::shared_ptr<Snapshot> snapshot_;
    std::function<void(const std::string&, const bus::WriteEvent&)> relay_listener_;
    /// Lines of earlier configurations too, closed: a client that still refers to one gets an
    /// answer, and a line of the same name and mode reuses it. Requests that were cut off may keep
    /// a snapshot, and so its lines, alive for longer than this.
    struct KnownLines {
        ~KnownLines();
        std::map<std::pair<std::string, Way>, std::shared_ptr<RunningLine>> lines;
    } known_;
    Images images_{loops_.plant, clock_, audit_.stray_writes()};
    std::unique_ptr<Discoveries> discoveries_;       ///< null until `http:` is configured
    std::unique_ptr<LineHistories> line_histories_;  ///< the same
    std::unique_ptr<points::Relays> relays_;
    Servers servers_;
    Northbound northbound_;
    std::unique_ptr<CertificateWatch> certificates_;  ///< null until a listener has `tls`
    std::unique_ptr<rt::Alarm> expiry_ =
        clock_.make_alarm();    ///< of tokens and clients' certificates
    WallTime expired_until_{};  ///< looked at for expiry so far
    Findings findings_;
    std::unique_ptr<rt::Alarm> looking_ = clock_.make_alarm();  ///< for findings
    TimePoint looked_{};                                        ///< for them
    std::size_t next_line_ = 0;                                 ///< whose counters are taken
    std::map<std::string, bus::MinuteUse> minutes_;             ///< by line, as of its last look
    bool ready_ = false;
};

}  // namespace panelgate::gateway
