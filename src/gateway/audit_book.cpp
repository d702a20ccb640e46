#include "panelgate/gateway/audit_book.hpp"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <boost/json/array.hpp>

#include "panelgate/base/network.hpp"
#include "panelgate/gateway/asked_place.hpp"
#include "panelgate/gateway/build_info.hpp"
#include "panelgate/gateway/snapshot.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/profile/notation.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::gateway {

namespace json = boost::json;

namespace {

using audit::add_text;
using audit::Members;

/// How a write ended, for somebody who asks whether the panel has changed.
std::string_view outcome_of(const bus::WriteEnd& end) {
    if (end.outcome == Outcome::refused || (end.transmitted && end.exception)) return "refused";
    if (end.outcome == Outcome::ok || end.outcome == Outcome::shared)
        return end.station == 0 ? "sent" : "confirmed";
    return end.transmitted ? "unknown" : "not_sent";
}

void add_outcome(Members& record, const bus::WriteEnd& end) {
    const std::string_view outcome = outcome_of(end);
    record["outcome"] = outcome;
    if (outcome == "unknown" || outcome == "not_sent") record["why"] = label(end.outcome);
    if (end.exception) {
        record["by"] = "panel";
        record["exception"] = *end.exception;
    }
    add_text(record, "rule", end.rule);
    if (end.transaction != 0) record["transaction"] = end.transaction;
}

std::uint16_t register_at(ByteView bytes, std::size_t at) {
    return static_cast<std::uint16_t>(bytes[at] << 8U | bytes[at + 1]);
}

/// In the panel's notation; of panels together and of one that is not listed, by table.
std::string notation_of(const Station* station, const modbus::Span& items) {
    if (station == nullptr)
        return std::string(modbus::label(items.table)) + '/' + std::to_string(items.first);
    return profile::format_notation(*station->configured->profile, items.table,
                                    static_cast<std::uint16_t>(items.first));
}

/// Where the values of a write begin; 0: it has none that are simply values.
std::size_t values_at(std::uint8_t function) {
    switch (function) {
        case modbus::kWriteSingleCoil:
        case modbus::kWriteSingleRegister:
            return 3;
        case modbus::kWriteMultipleCoils:
        case modbus::kWriteMultipleRegisters:
            return 6;
        case modbus::kReadWriteMultipleRegisters:
            return 10;
        default:
            return 0;
    }
}

/// The values of a write; empty: its PDU has none that are simply values.
json::array values_of(ByteView pdu, const modbus::Span& items) {
    const std::size_t at = values_at(pdu[0]);
    const bool bits = modbus::is_bit_table(items.table);
    const std::size_t size = bits ? 1 : std::size_t{2} * items.count;
    if (at == 0 || pdu.size() < at + size) return {};
    const bool single = pdu[0] == modbus::kWriteSingleCoil;
    // A coil that is neither on nor off: what that means is the panel's.
    const bool odd = single && pdu.size() == 5 && (pdu[4] != 0 || (pdu[3] != 0 && pdu[3] != 0xFF));
    json::array values;
    for (std::size_t i = 0; i < items.count && !odd; ++i) {
        const std::size_t byte = std::min(at + i / 8, pdu.size() - 1);
        const unsigned bit = single ? pdu[at] != 0 : pdu[byte] >> (i % 8) & 1U;
        values.emplace_back(bits ? bit : register_at(pdu, at + 2 * i));
    }
    return values;
}

void add_items(Members& record, const Station* station, const bus::WriteEnd& end) {
    const modbus::Span& items = *end.items;
    add_text(record, "at", notation_of(station, items));
    record["function"] = end.pdu[0];
    record["table"] = modbus::label(items.table);
    record["address"] = items.first;
    record["count"] = items.count;
    json::array values = values_of(end.pdu, items);
    if (end.pdu[0] == modbus::kMaskWriteRegister && end.pdu.size() == 7) {
        record["and_mask"] = register_at(end.pdu, 3);
        record["or_mask"] = register_at(end.pdu, 5);
    } else if (values.empty()) {
        record["pdu"] = to_hex(end.pdu, "");
    } else {
        record["values"] = std::move(values);
    }
}

/// A client without the port, which each of its connections has anew.
Members client_of(const WhoRef& who) {
    Members members;
    if (!who) return members;
    add_text(members, "address", HostKey(who->address).text());
    members["face"] = label(who->face);
    if (who->address.empty()) add_text(members, "client", who->name);
    add_text(members, "token", who->token);
    add_text(members, "user", who->user);
    return members;
}

void log_anchor(const audit::Position& at, const std::string& chain, const std::string& file) {
    rt::log(rt::LogLevel::info, "audit anchor",
            {{"number", std::to_string(at.number)},
             {"hash", at.hash},
             {"chain", chain},
             {"file", file}});
}

/// What the disk has not taken is gone: the log is the only place that can say so.
void tell_of_end(const audit::Trail::End& end, const std::string& file) {
    if (end.unwritten > 0)
        rt::log(rt::LogLevel::error, "audit records lost",
                {{"count", std::to_string(end.unwritten)}, {"file", file}});
    if (end.last.number > 0) log_anchor(end.last, end.chain, file);
}

}  // namespace

void add_who(Members& record, const WhoRef& who) {
    if (!who) return;
    add_text(record, "client", who->name);
    add_text(record, "face", label(who->face));
    add_text(record, "listener", who->listener);
    add_text(record, "token", who->token);
    if (who->standing.role != Role::none) add_text(record, "role", who->standing.name());
    add_text(record, "certificate", who->certificate);
    add_text(record, "certificate_role", who->certificate_role);
    add_text(record, "user", who->user);
}

AuditBook::AuditBook(boost::asio::any_io_executor executor, rt::Clock& clock)
    : executor_(std::move(executor)), clock_(clock), alarm_(clock.make_alarm()) {}

AuditBook::~AuditBook() { close(); }

void AuditBook::apply(const std::optional<audit::Settings>& settings) {
    const bool stays = trail_ && settings && settings->file == settings_.file;
    if (trail_ && !stays)
        end_trail(settings ? "the audit goes on in " + settings->file
                           : "the audit is switched off");
    if (settings) settings_ = *settings;
    if (stays) return trail_->apply(settings_);
    if (settings) begin_trail();
}

void AuditBook::begin_trail() {
    audit::Trail::Hooks hooks;
    hooks.wall = rt::wall_now;
    add_text(hooks.start, "version", PANELGATE_VERSION);
    add_text(hooks.start, "commit", build_commit());
    hooks.tell = [this, executor = executor_, life = std::weak_ptr(alive_)](audit::Notice notice) {
        boost::asio::post(executor, [this, life, notice = std::move(notice)] {
            if (!life.expired()) tell(notice);
        });
    };
    trail_ = std::make_unique<audit::Trail>(settings_, std::move(hooks));
}

void AuditBook::end_trail(const std::string& why) {
    record_repeats(true);
    Members record = audit::record_of("end", rt::wall_now());
    add_text(record, "why", why);
    trail_->add(record);
    const std::shared_ptr<audit::Trail> last = std::move(trail_);
    const auto end = std::make_shared<audit::Trail::End>();
    if (!closing_) closing_.emplace(executor_);
    closing_->run([last, end] { *end = last->close(); },
                  [end, file = settings_.file] { tell_of_end(*end, file); });
}

void AuditBook::put(const Members& record) {
    if (trail_) trail_->add(record);
    if (listener_) listener_(record);
}

void AuditBook::close() {
    if (!trail_) return;
    record_repeats(true);
    trail_->add(audit::record_of("end", rt::wall_now()));
    tell_of_end(trail_->close(), settings_.file);
    trail_.reset();
}

void AuditBook::tell(const audit::Notice& notice) const {
    using Notice = audit::Notice::Kind;
    const std::string& file = settings_.file;
    const bool refuses = settings_.on_failure == audit::OnFailure::refuse_writes;
    switch (notice.kind) {
        case Notice::failing:
            return rt::log(rt::LogLevel::error, "audit fails",
                           {{"file", file},
                            {"why", notice.text},
                            {"writes", refuses ? "are refused" : "go on, and are recorded later"}});
        case Notice::recovered:
            return rt::log(rt::LogLevel::info, "audit recovered",
                           {{"file", file}, {"lost", std::to_string(counters().lost)}});
        case Notice::anchor:
            return log_anchor(notice.at, notice.text, file);
        case Notice::remark:
            return rt::log(rt::LogLevel::warn, "audit file",
                           {{"file", file}, {"why", notice.text}});
    }
}

void AuditBook::write(const std::string& line, const bus::WriteEnd& end) {
    if (!is_heard()) return;
    const bool refused = end.outcome == Outcome::refused;
    if (refused) refused_ = end.who;
    const Station* const station = snapshot_ ? snapshot_->plant.find(line, end.station) : nullptr;
    if (!end.transmitted && end.outcome != Outcome::ok) {
        Members what;
        add_text(what, "line", line);
        add_text(what, "station", station ? station->name : std::to_string(end.station));
        if (end.items) add_text(what, "at", notation_of(station, *end.items));
        if (!end.pdu.empty()) what["function"] = end.pdu[0];
        what["outcome"] = outcome_of(end);
        add_text(what, refused ? "rule" : "why", refused ? end.rule : label(end.outcome));
        if (is_repeat(end.who, "write", what)) return;
    }
    Members record = audit::record_of("write", rt::wall_now());
    add_who(record, end.who);
    if (station != nullptr) {
        audit::add(record, members_of(AskedPlace{line, station}));
    } else {
        record["line"] = line;
        record["id"] = end.station;
    }
    if (end.items) {
        add_items(record, station, end);
        if (station != nullptr) add_before(record, *station, *end.items);
    } else if (!end.pdu.empty()) {
        record["function"] = end.pdu[0];
        record["pdu"] = to_hex(end.pdu, "");
    }
    add_outcome(record, end);
    put(record);
    if (end.transmitted) written_[{line, end.station}] = clock_.now();
}

/// Adds the value that was polled last, if no write of ours came between.
void AuditBook::add_before(Members& record, const Station& station,
                           const modbus::Span& items) const {
    if (!station.points) return;
    const points::StationPoints& points = *station.points;
    const auto found = std::ranges::find_if(points.points(), [&](const points::Point& point) {
        return modbus::Span{point.table, point.address, point.count()}.contains(items);
    });
    if (found == points.points().end()) return;
    const std::vector<std::uint16_t>& polled = points.items(*found);
    const TimePoint now = clock_.now();
    const auto age = points.read(*found, now).age;
    const std::size_t from = items.first - found->address;
    if (!age || polled.size() < from + items.count) return;
    for (const std::uint8_t id : {station.id, std::uint8_t{0}}) {
        const auto written = written_.find({station.line, id});
        if (written != written_.end() && now - *age <= written->second) return;
    }
    const auto begin = polled.begin() + static_cast<std::ptrdiff_t>(from);
    record["before"] = json::array(begin, begin + static_cast<std::ptrdiff_t>(items.count));
    record["before_age_ms"] = static_cast<std::uint64_t>(to_milliseconds(*age));
}

bool AuditBook::is_repeat(const WhoRef& who, std::string_view kind, const Members& what) {
    Members client = client_of(who);
    if (kind == "login") client["of"] = kind;
    const bool is_new = repeats_.is_new(clock_.now(), rt::wall_now(), client, what);
    if (!waits_) wait_for_repeats();
    return !is_new;
}

void AuditBook::wait_for_repeats() {
    constexpr Duration kLook = 1s;
    waits_ = !repeats_.empty();
    if (!waits_) return;
    alarm_->arm(clock_.now() + kLook, [this] {
        record_repeats(false);
        wait_for_repeats();
    });
}

void AuditBook::record_repeats(bool all) {
    for (const Members& counted : repeats_.due(clock_.now(), all)) {
        if (!is_heard()) return;
        Members record = audit::record_of("repeats", rt::wall_now());
        audit::add(record, counted);
        put(record);
    }
}

}  // namespace panelgate::gateway
