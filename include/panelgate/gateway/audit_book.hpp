#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/audit/counters.hpp"
#include "panelgate/audit/record.hpp"
#include "panelgate/audit/repeats.hpp"
#include "panelgate/audit/settings.hpp"
#include "panelgate/audit/trail.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/base/who.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/gateway/plant.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/rt/process.hpp"
#include "panelgate/web/api/sources.hpp"
#include "panelgate/web/http/message.hpp"
#include "panelgate/web/http/settings.hpp"

namespace panelgate::gateway {

struct Snapshot;
struct TopicRefusal;

/// Composes the audit's record of each event. Without `audit:` nothing is recorded. One thread.
class AuditBook {
  public:
    static constexpr std::size_t kChanges = 200;  ///< of a reload, told

    /// The clock outlives it.
    AuditBook(boost::asio::any_io_executor executor, rt::Clock& clock);
    ~AuditBook();
    AuditBook(const AuditBook&) = delete;
    AuditBook& operator=(const AuditBook&) = delete;

    /// Keeps the audit as configured from now on; nullopt: no more.
    void apply(const std::optional<audit::Settings>& settings);
    /// The stations whose names, notations and last values are recorded from now on.
    void show(std::shared_ptr<const Snapshot> snapshot) { snapshot_ = std::move(snapshot); }
    /// The gateway ends in order: records that, and ends the trail.
    void close();

    /// Calls the listener with each record but those of the trail itself, with and without an
    /// audit.
    void on_record(std::function<void(const audit::Members&)> listener) {
        listener_ = std::move(listener);
    }

    void write(const std::string& line, const bus::WriteEnd& end);
    /// True while writes must not be sent.
    bool refuses_writes() const {
        return settings_.on_failure == audit::OnFailure::refuse_writes && counters().failing;
    }
    bool is_kept() const { return trail_ != nullptr; }

    /// A client of deed() that may outlive this.
    std::function<void(const web::Deed&)> deeds();
    /// What a client of REST changed, or was refused; writes are the buses'.
    void deed(const web::Deed& deed);
    /// Returns the client for refusals that MQTT makes before a bus; the client may outlive the
    /// book.
    std::function<void(const TopicRefusal&)> topic_refusals();
    /// A client of the writes over Modbus/TCP that come to no line; the client may outlive this.
    std::function<void(const WhoRef&, std::uint8_t unit, ByteView pdu)> stray_writes();
    /// A reload or a rollback, and what it changed.
    void reload(const web::ReloadVerdict& verdict);
    /// Tokens that came, went or changed.
    void tokens(const std::vector<web::Token>& before, const std::vector<web::Token>& now);
    void expired(const web::Token& token) { record_token(token, "expired"); }

    /// Zeros without an audit.
    audit::Counters counters() const { return trail_ ? trail_->counters() : audit::Counters{}; }

  private:
    using Members = audit::Members;

    void begin_trail();
    bool is_heard() const { return trail_ != nullptr || listener_; }
    void put(const Members& record);
    /// Records the end; the trail writes what waits on a thread of its own, for a disk may be slow.
    void end_trail(const std::string& why);
    /// True if `what` of this client was recorded a short time ago: it is counted then. Each kind
    /// of record has places of its own.
    bool is_repeat(const WhoRef& who, std::string_view kind, const Members& what);
    void record_repeats(bool all);
    void wait_for_repeats();
    void add_before(Members& record, const Station& station, const modbus::Span& items) const;
    Members place_of(const web::Deed& deed) const;
    void record_text(const web::Deed& deed);
    void record_or_count(std::string_view kind, const WhoRef& who, const Members& what,
                         const Members& details);
    void record_token(const web::Token& token, std::string_view event);
    void tell(const audit::Notice& notice) const;

    boost::asio::any_io_executor executor_;
    rt::Clock& clock_;
    std::unique_ptr<rt::Alarm> alarm_;
    std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
    audit::Settings settings_;             ///< of the trail
    std::optional<rt::Worker> closing_;    ///< ends trails
    std::unique_ptr<audit::Trail> trail_;  ///< null without an audit
    std::function<void(const Members&)> listener_;
    audit::Repeats repeats_;
    bool waits_ = false;
    std::shared_ptr<const Snapshot> snapshot_;
    /// The last writes that may have had an effect, by line and station (0: a broadcast).
    std::map<std::pair<std::string, std::uint8_t>, TimePoint> written_;
    WhoRef refused_;  ///< the client of the write that a bus has just refused
};

/// Adds who made a request to a record.
void add_who(audit::Members& record, const WhoRef& who);

}  // namespace panelgate::gateway
