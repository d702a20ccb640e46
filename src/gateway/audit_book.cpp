#include "panelgate/gateway/audit_book.hpp"

#include <arpa/inet.h>
#include <algorithm>
#include <array>
#include <boost/asio/post.hpp>
#include <utility>

#include "panelgate/gateway/asked_place.hpp"
#include "panelgate/gateway/build_info.hpp"
#include "panelgate/gateway/snapshot.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/profile/notation.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::gateway {

namespace {

using audit::Composer;
using audit::Kind;
using audit::member;

/// Who it is, as members of a record.
std::string who_members(const Who& who) {
    return audit::members_by([&](Composer& record) {
        record.text("client", who.name).text("face", label(who.face));
        record.text("listener", who.listener).text("token", who.token);
        if (who.standing.role != Role::none) record.text("role", who.standing.name());
        record.text("certificate", who.certificate).text("certificate_role", who.certificate_role);
        record.text("user", who.user);
    });
}

/// How a write ended, for somebody who asks whether the panel has changed.
std::string_view outcome_of(const bus::WriteEnd& end) {
    if (end.outcome == Outcome::refused) return "refused";
    if (end.transmitted && end.exception) return "refused";
    if (end.outcome == Outcome::ok || end.outcome == Outcome::shared)
        return end.station == 0 ? "sent" : "confirmed";
    return end.transmitted ? "unknown" : "not_sent";
}

void add_outcome(Composer& record, const bus::WriteEnd& end) {
    const std::string_view outcome = outcome_of(end);
    record.word("outcome", outcome);
    if (outcome == "unknown" || outcome == "not_sent") record.word("why", label(end.outcome));
    if (end.exception) record.word("by", "panel").number("exception", *end.exception);
    record.text("rule", end.rule);
    if (end.transaction != 0) record.number("transaction", end.transaction);
}

std::uint16_t register_at(ByteView bytes, std::size_t at) {
    return static_cast<std::uint16_t>(bytes[at] << 8U | bytes[at + 1]);
}

std::string plain_place(const modbus::Span& items) {
    return std::string(modbus::label(items.table)) + '/' + std::to_string(items.first);
}

/// In the panel's notation; of panels together and of one that is not listed, by table.
std::string notation_of(const Station* station, const modbus::Span& items) {
    if (station == nullptr) return plain_place(items);
    return profile::format_notation(*station->configured->profile, items.table,
                                    static_cast<std::uint16_t>(items.first));
}

/// Which items a write is about, as members of a record.
std::string place_members(const Station* station, std::uint8_t function,
                          const modbus::Span& items) {
    return audit::members_by([&](Composer& record) {
        record.text("at", notation_of(station, items)).number("function", function);
        record.word("table", modbus::label(items.table)).number("address", items.first);
        record.number("count", items.count);
    });
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

/// An IPv6 network of 64 bits is one client: its addresses cost nothing (docs/operate/audit.md).
std::string_view network_of(std::string_view address, std::string& room) {
    std::array<std::uint8_t, 16> bytes{};
    room = address.substr(0, address.find('%'));
    if (::inet_pton(AF_INET6, room.c_str(), bytes.data()) != 1) return address;
    room.assign(bytes.begin(), bytes.begin() + 8);
    room += "/64";
    return room;
}

/// Makes the client's key; refusals of a kind are counted by client.
void make_client_key(std::string& key, const WhoRef& who) {
    key.clear();
    if (who) {
        // A serial master and the gateway's own have no address, but a name without a port.
        std::string room;
        key += label(who->face);
        key += '\t';
        key += who->address.empty() && who->user.empty() ? std::string_view(who->name)
                                                         : network_of(who->address, room);
        key += '\t';
        key += who->token;
        key += '\t';
        key += who->user;
    }
    key += '\t';
}

/// A client without the port, which each of its connections has anew.
std::string client_members(const WhoRef& who) {
    return audit::members_by([&](Composer& members) {
        if (!who) return;
        members.text("address", who->address).text("face", label(who->face));
        if (who->address.empty()) members.text("client", who->name);
        members.text("token", who->token).text("user", who->user);
    });
}

void log_anchor(const audit::Position& at, const std::string& chain, const std::string& file) {
    rt::log(rt::LogLevel::info, "audit anchor",
            {{"number", std::to_string(at.number)},
             {"hash", std::string(text_of(at.hash))},
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

AuditBook::AuditBook(boost::asio::any_io_executor executor, rt::Clock& clock)
    : executor_(std::move(executor)),
      clock_(clock),
      alarm_(clock.make_alarm()),
      gathered_alarm_(clock.make_alarm()) {}

AuditBook::~AuditBook() { close(); }

void AuditBook::apply(const std::optional<audit::Settings>& settings) {
    if (!settings) {
        if (!trail_) return;
        record_repeats(true);
        begin(Kind::end).text("why", "the audit is switched off");
        record();
        std::shared_ptr<audit::Trail> last = std::move(trail_);
        if (!closing_) closing_.emplace(executor_);
        const auto end = std::make_shared<audit::Trail::End>();
        closing_->run([last, end] { *end = last->close(); },  // the disk may be slow
                      [end, file = file_] { tell_of_end(*end, file); });
        return;
    }
    if (trail_ && file_ != settings->file) {
        record_repeats(true);
        begin(Kind::end).text("why", "the audit goes on in " + settings->file);
        record();
    }
    on_failure_ = settings->on_failure;
    file_ = settings->file;
    audit::Settings rest = *settings;
    rest.flush -= std::min<Duration>(rest.flush, kGatheredFor);  // which it may have waited here
    if (trail_) return trail_->apply(rest);
    audit::Trail::Hooks hooks;
    hooks.wall = rt::wall_now;
    hooks.start = member("version", PANELGATE_VERSION) + member("commit", build_commit());
    hooks.tell = [this, executor = executor_, life = std::weak_ptr(alive_)](audit::Notice notice) {
        boost::asio::post(executor, [this, life, notice = std::move(notice)] {
            if (!life.expired()) tell(notice);
        });
    };
    trail_ = std::make_unique<audit::Trail>(rest, std::move(hooks));
}

void AuditBook::tell(const audit::Notice& notice) {
    using Notice = audit::Notice::Kind;
    switch (notice.kind) {
        case Notice::failing:
            return rt::log(
                rt::LogLevel::error, "audit fails",
                {{"file", file_}, {"why", notice.text}, {"writes", writes_while_failing()}});
        case Notice::recovered:
            return rt::log(rt::LogLevel::info, "audit recovered",
                           {{"file", file_}, {"lost", std::to_string(counters().lost)}});
        case Notice::anchor:
            return log_anchor(notice.at, notice.text, file_);
        case Notice::remark:
            return rt::log(rt::LogLevel::warn, "audit file",
                           {{"file", file_}, {"why", notice.text}});
    }
}

std::string AuditBook::writes_while_failing() const {
    return on_failure_ == audit::OnFailure::refuse_writes ? "are refused"
                                                          : "go on, and are recorded later";
}

void AuditBook::close() {
    if (!trail_) return;
    record_repeats(true);
    begin(Kind::end);
    record();
    tell_of_end(trail_->close(), file_);
    trail_.reset();
}

void AuditBook::show(std::shared_ptr<const Snapshot> snapshot) {
    record_gathered();  // by the names that they were made by
    std::map<std::string, std::map<std::uint8_t, Known>, std::less<>> next;
    for (const Station& station : snapshot->plant.stations()) {
        Known& known = next[station.line][station.id];
        known.station = &station;
        known.members = members_of(AskedPlace{station.line, &station});
        if (const Known* before = find(station.line, station.id)) known.written = before->written;
    }
    known_ = std::move(next);
    snapshot_ = std::move(snapshot);
}

AuditBook::Known* AuditBook::find(const std::string& line, std::uint8_t id) {
    const auto stations = known_.find(line);
    if (stations == known_.end()) return nullptr;
    const auto found = stations->second.find(id);
    return found == stations->second.end() ? nullptr : &found->second;
}

/// What tells which items of a station are written is made once for each place.
void AuditBook::add_place(Known* known, std::uint8_t function, const modbus::Span& items) {
    const Station* station = known != nullptr ? known->station : nullptr;
    if (known == nullptr) {
        composer_.members(place_members(station, function, items));
        return;
    }
    const std::uint64_t key = std::uint64_t{function} << 48U |
                              static_cast<std::uint64_t>(items.table) << 40U |
                              static_cast<std::uint64_t>(items.first) << 20U | items.count;
    auto place = known->places.find(key);
    if (place == known->places.end()) {
        if (known->places.size() >= kPlaces) known->places.clear();
        place = known->places.emplace(key, place_members(station, function, items)).first;
    }
    composer_.members(place->second);
}

/// What tells who it is is made once for each client.
void AuditBook::add_who(const WhoRef& who) {
    if (!who) return;
    if (const auto known = clients_.find(who); known != clients_.end()) {
        composer_.members(known->second);
        return;
    }
    if (clients_.size() >= kClients) clients_.clear();
    composer_.members(clients_.emplace(who, who_members(*who)).first->second);
}

void AuditBook::write(const std::string& line, const bus::WriteEnd& end) {
    if (!trail_) return;
    Known* known = find(line, end.station);
    const bool is_vain = !end.transmitted && end.outcome != Outcome::ok;
    if (end.outcome == Outcome::refused) refused_ = end.who;
    if (is_vain && is_vain_repeat(line, end, known)) return;
    if (gathered_.empty())
        gathered_alarm_->arm(clock_.now() + kGatheredFor, [this] { record_gathered(); });
    Gathered& write = gathered_.emplace_back(rt::wall_now(), end, line, known);
    if (known != nullptr && end.items) write.before = before(*known, *end.items);
    if (end.transmitted) note_effect(line, end.station, known);
    if (gathered_.size() >= kGathered) record_gathered();
}

/// What was polled before is no longer what the panel has.
void AuditBook::note_effect(const std::string& line, std::uint8_t station, Known* known) {
    const TimePoint now = clock_.now();
    if (known != nullptr) known->written = now;
    if (station != 0) return;
    for (auto& [id, each] : known_[line]) each.written = now;
}

void AuditBook::record_gathered() {
    for (const Gathered& write : gathered_) {
        add_write(write);
        record();
    }
    gathered_.clear();
}

void AuditBook::add_write(const Gathered& write) {
    const bus::WriteEnd& end = write.end;
    Composer& record = composer_.begin(write.at, Kind::write);
    add_who(end.who);
    if (write.known != nullptr)
        record.members(write.known->members);
    else
        record.text("line", write.line).number("id", end.station);
    if (end.items) {
        add_place(write.known, end.pdu[0], *end.items);
        add_values(end.pdu, *end.items);
    } else {
        if (!end.pdu.empty()) record.number("function", end.pdu[0]);
        record.hex("pdu", end.pdu);
    }
    if (write.before)
        record.numbers("before", write.before->items).number("before_age_ms", write.before->age_ms);
    add_outcome(record, end);
}

void AuditBook::add_values(ByteView pdu, const modbus::Span& items) {
    const std::size_t at = values_at(pdu[0]);
    const std::size_t each = modbus::is_bit_table(items.table) ? 0 : 2;
    if (pdu[0] == modbus::kMaskWriteRegister && pdu.size() == 7) {
        composer_.number("and_mask", register_at(pdu, 3)).number("or_mask", register_at(pdu, 5));
    } else if (pdu[0] == modbus::kWriteSingleCoil && pdu.size() == 5 &&
               (pdu[4] != 0 || (pdu[3] != 0 && pdu[3] != 0xFF))) {
        composer_.hex("pdu", pdu);  // neither on nor off: what it means is the panel's
    } else if (at == 0 || pdu.size() < at + std::max<std::size_t>(each * items.count, 1)) {
        composer_.hex("pdu", pdu);
    } else {
        values_.clear();
        for (std::size_t i = 0; i < items.count; ++i) {
            const bool single = pdu[0] == modbus::kWriteSingleCoil;
            const std::size_t byte = std::min(at + i / 8, pdu.size() - 1);
            const unsigned bit = single ? pdu[at] != 0 : pdu[byte] >> (i % 8) & 1U;
            values_.push_back(each == 0 ? static_cast<std::uint16_t>(bit)
                                        : register_at(pdu, at + 2 * i));
        }
        composer_.numbers("values", values_);
    }
}

/// The value that was polled last, if no write of ours came between.
std::optional<AuditBook::Before> AuditBook::before(const Known& known,
                                                   const modbus::Span& items) const {
    if (!known.station->points) return std::nullopt;
    const points::StationPoints& points = *known.station->points;
    const auto holds = [&](const points::Point& point) {
        return modbus::Span{point.table, point.address, point.count()}.contains(items);
    };
    const auto found = std::ranges::find_if(points.points(), holds);
    if (found == points.points().end()) return std::nullopt;
    const std::vector<std::uint16_t>& polled = points.items(*found);
    const TimePoint now = clock_.now();
    const auto age = points.read(*found, now).age;
    const std::size_t from = items.first - found->address;
    if (!age || polled.size() < from + items.count) return std::nullopt;
    if (known.written && now - *age <= *known.written) return std::nullopt;
    const auto begin = polled.begin() + static_cast<std::ptrdiff_t>(from);
    return Before{{begin, begin + static_cast<std::ptrdiff_t>(items.count)},
                  static_cast<std::uint64_t>(to_milliseconds(*age))};
}

bool AuditBook::is_vain_repeat(const std::string& line, const bus::WriteEnd& end, Known* known) {
    const bool refused = end.outcome == Outcome::refused;
    std::string& what = what_;
    what = line;
    what += '/';
    what += std::to_string(end.station);
    what += '\t';
    what += label(end.outcome);
    what += '\t';
    what += end.rule;
    what += '\t';
    if (!end.pdu.empty()) what += std::to_string(end.pdu[0]);
    what += '\t';
    if (end.items) what += plain_place(*end.items);
    return is_repeat(end.who, what, refused ? 1 : kNotSent, [&] {
        const Station* listed = known != nullptr ? known->station : nullptr;
        const std::string station = listed ? listed->name : std::to_string(end.station);
        const std::string at = end.items ? member("at", notation_of(listed, *end.items)) : "";
        return member("line", line) + member("station", station) + at +
               member("outcome", outcome_of(end)) +
               (refused ? end.rule.empty() ? std::string() : member("rule", end.rule)
                        : member("why", label(end.outcome)));
    });
}

bool AuditBook::is_repeat(const WhoRef& who, std::string_view what, unsigned in_full,
                          const std::function<std::string()>& more, bool shares) {
    make_client_key(key_, who);
    const std::size_t client = key_.size();
    key_ += what;
    const auto members = [&] { return client_members(who); };
    const audit::Repeats::Client one{std::string_view(key_).substr(0, shares ? client : 0),
                                     members};
    const bool is_new = repeats_.is_new(
        clock_.now(), rt::wall_now(), key_, in_full, [&] { return members() + more(); }, one);
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
    for (const audit::Repeats::Counted& counted : repeats_.due(clock_.now(), all)) {
        if (!trail_) return;
        begin(Kind::repeats).number("count", counted.count);
        composer_.time("first", counted.first).time("last", counted.last);
        trail_->add(std::string(composer_.body()) + counted.members);
    }
}

audit::Counters AuditBook::counters() const {
    return trail_ ? trail_->counters() : audit::Counters{};
}

}  // namespace panelgate::gateway
