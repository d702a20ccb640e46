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
#include <unordered_map>
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
#include "panelgate/modbus/function.hpp"
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
    static constexpr std::size_t kPlaces = 4096;   ///< of a station, whose members are kept
    static constexpr std::size_t kClients = 1024;  ///< whose members are kept
    static constexpr std::size_t kChanges = 200;   ///< of a reload, told
    static constexpr unsigned kNotSent = 3;  ///< writes to one place that were not sent, in full
    static constexpr std::size_t kGathered = 64;     ///< writes that are composed together
    static constexpr Duration kGatheredFor = 200ms;  ///< and how long the first of them waits

    /// The clock outlives it.
    AuditBook(boost::asio::any_io_executor executor, rt::Clock& clock);
    ~AuditBook();
    AuditBook(const AuditBook&) = delete;
    AuditBook& operator=(const AuditBook&) = delete;

    /// Keeps it as configured from now on; nullopt: no more.
    void apply(const std::optional<audit::Settings>& settings);
    /// The stations whose names, notations and last values are recorded from now on.
    void show(std::shared_ptr<const Snapshot> snapshot);
    /// The gateway ends in order: records it, and ends the trail.
    void close();

    void write(const std::string& line, const bus::WriteEnd& end);
    /// True while writes must not be sent.
    bool refuses_writes() const {
        return trail_ && on_failure_ == audit::OnFailure::refuse_writes && trail_->is_failing();
    }
    bool is_kept() const { return trail_ != nullptr; }

    /// A client of deed() that may outlive this.
    std::function<void(const web::Deed&)> deeds();
    /// What a client of REST changed, or was refused; writes are the buses'.
    void deed(const web::Deed& deed);
    /// Returns the client for refusals that MQTT makes before a bus; the client may outlive the
    /// book.
    std::function<void(const TopicRefusal&)> topic_refusals();
    /// A client of the writes over Modbus/TCP that come to no line; it may outlive this.
    std::function<void(const WhoRef&, std::uint8_t unit, ByteView pdu)> stray_writes();
    /// A reload or a rollback, and what it changed.
    void reload(const web::ReloadVerdict& verdict);
    /// Tokens that came, went or changed.
    void tokens(const std::vector<web::Token>& before, const std::vector<web::Token>& now);
    void expired(const web::Token& token);

    /// Zeros without an audit.
    audit::Counters counters() const;

  private:
    using Composer = audit::Composer;

    struct Known;

    /// What a face refused before it came to a bus.
    struct Refused {
        WhoRef who;
        std::string place;  ///< members of a record
        std::string method;
        std::string path;
        std::string_view body{};
        std::string rule{};  ///< a member of a record, or empty
        unsigned status = 0;
        std::string why{};
    };

    /// What was polled of a place before it was written.
    struct Before {
        std::vector<std::uint16_t> items;
        std::uint64_t age_ms = 0;
    };
    /// A write that is composed together with other writes: rare code runs with cold caches, and
    /// composing many writes at once costs far less a write.
    struct Gathered {
        WallTime at{};
        bus::WriteEnd end;
        std::string line;
        Known* known = nullptr;
        std::optional<Before> before{};
    };

    /// Records are in the order of what they tell.
    Composer& begin(audit::Kind kind) {
        record_gathered();
        return composer_.begin(rt::wall_now(), kind);
    }
    void note_effect(const std::string& line, std::uint8_t station, Known* known);
    void record_gathered();
    void add_who(const WhoRef& who);
    void add_write(const Gathered& write);
    void add_values(ByteView pdu, const modbus::Span& items);
    std::optional<Before> before(const Known& known, const modbus::Span& items) const;
    /// True if it was counted. `more`: members that tell what is repeated, besides the client;
    /// `shares`: where the client repeats many things, it is counted with the others.
    bool is_repeat(const WhoRef& who, std::string_view what, unsigned in_full,
                   const std::function<std::string()>& more, bool shares = true);
    bool is_vain_repeat(const std::string& line, const bus::WriteEnd& end, Known* known);
    void refusal(const web::Deed& deed);
    void record_refusal(const Refused& refused);
    void record_token(const web::Token& token, std::string_view event);
    std::string place_of(const web::Deed& deed) const;
    void record() { trail_->add(composer_.body()); }
    void record_repeats(bool all);
    void wait_for_repeats();
    void tell(const audit::Notice& notice);
    std::string writes_while_failing() const;

    boost::asio::any_io_executor executor_;
    rt::Clock& clock_;
    std::unique_ptr<rt::Alarm> alarm_;
    std::unique_ptr<rt::Alarm> gathered_alarm_;
    std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
    audit::OnFailure on_failure_ = audit::OnFailure::keep_on;
    std::string file_;
    std::optional<rt::Worker> closing_;    ///< ends trails: a disk may be slow
    std::unique_ptr<audit::Trail> trail_;  ///< null without an audit
    audit::Composer composer_;
    audit::Repeats repeats_;
    bool waits_ = false;

    /// A station as records name it.
    struct Known {
        const Station* station = nullptr;
        std::string members{};  ///< of a record, that tell where it is
        std::unordered_map<std::uint64_t, std::string> places{};  ///< members that tell what
        std::optional<TimePoint> written{};  ///< the last write that may have had an effect
    };
    Known* find(const std::string& line, std::uint8_t id);
    void add_place(Known* known, std::uint8_t function, const modbus::Span& items);

    std::shared_ptr<const Snapshot> snapshot_;
    std::map<std::string, std::map<std::uint8_t, Known>, std::less<>> known_;
    std::unordered_map<WhoRef, std::string> clients_;  ///< what records tell of them
    std::vector<Gathered> gathered_;
    std::vector<std::uint16_t> values_;
    WhoRef refused_;  ///< the client of the write that a bus has just refused
    std::string key_;
    std::string what_;
};

}  // namespace panelgate::gateway
