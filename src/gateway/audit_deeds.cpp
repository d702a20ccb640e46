// What an audit records of clients' deeds besides writes: refusals, log-ins, reloads, tokens.
#include <algorithm>
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/value.hpp>
#include <utility>

#include "panelgate/base/text.hpp"
#include "panelgate/gateway/asked_place.hpp"
#include "panelgate/gateway/audit_book.hpp"
#include "panelgate/gateway/northbound.hpp"
#include "panelgate/gateway/snapshot.hpp"
#include "panelgate/profile/notation.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::gateway {

namespace {

using audit::add_text;
using audit::Members;

/// The text of a member of a problem (RFC 9457), such as `detail`; "" if it has none.
std::string text_in(std::string_view body, std::string_view key) {
    boost::system::error_code wrong;
    const boost::json::value value = boost::json::parse(body, wrong);
    const auto* object = wrong ? nullptr : value.if_object();
    return object != nullptr ? web::member_text(*object, key) : std::string();
}

/// Adds the first texts of a list.
void add_some(Members& record, std::string_view key, const std::vector<std::string>& texts) {
    boost::json::array list;
    for (const std::string& text : texts)
        if (list.size() < AuditBook::kChanges) list.emplace_back(as_utf8(text));
    record[key] = std::move(list);
}

}  // namespace

std::function<void(const web::Deed&)> AuditBook::deeds() {
    return [this, life = std::weak_ptr(alive_)](const web::Deed& what) {
        if (!life.expired()) deed(what);
    };
}

void AuditBook::deed(const web::Deed& deed) {
    if (!is_heard()) return;
    // A write has one record: the bus records refusals of its own, the reloader reloads.
    const bool is_told = std::exchange(refused_, nullptr) == deed.who && deed.who != nullptr;
    const bool lacks_right = deed.status == 401 || deed.status == 403 || deed.status == 429;
    const bool is_reload = deed.path.ends_with("/reload") && !lacks_right;
    const bool discovers = deed.path.ends_with("/discover");
    const bool simulates = deed.path.find("/simulator/") != deed.path.npos;
    Members details;
    if (deed.path.starts_with("/api/v1/configuration/") && !lacks_right) {
        record_text(deed);
    } else if (deed.status < 400 && (discovers || simulates)) {
        Members record = audit::record_of(discovers ? "discovery" : "simulator", rt::wall_now());
        add_who(record, deed.who);
        audit::add(record, place_of(deed));
        add_text(record, "method", deed.method);
        add_text(record, "path", deed.path);
        add_text(record, "body", deed.body);
        put(record);
    } else if (lacks_right && deed.status != 403 && deed.shown_token) {
        add_text(details, "path", deed.path);
        add_text(details, "why", text_in(deed.answer, "detail"));
        record_or_count("login", deed.who, {{"outcome", "failed"}}, details);
    } else if (!is_told && !is_reload &&
               (lacks_right || deed.status == 409 || deed.status == 422)) {
        Members what = place_of(deed);
        add_text(what, "method", deed.method);
        add_text(what, "path", deed.path);
        what["outcome"] = "refused";
        add_text(what, "rule", text_in(deed.answer, "rule"));
        what["status"] = deed.status;
        add_text(details, "body", deed.body);
        add_text(details, "why", text_in(deed.answer, "detail"));
        record_or_count("refusal", deed.who, what, details);
    }
}

/// A call about the configuration's text, without the text.
void AuditBook::record_text(const web::Deed& deed) {
    Members what;
    add_text(what, "method", deed.method);
    add_text(what, "path", deed.path);
    what["outcome"] = deed.status < 400 ? "done" : "refused";
    what["status"] = deed.status;
    Members details;
    add_text(details, "why", text_in(deed.answer, "detail"));
    record_or_count("configuration", deed.who, what, details);
}

audit::Members AuditBook::place_of(const web::Deed& deed) const {
    return snapshot_ ? members_of(asked_place(snapshot_->plant, deed.path, deed.body)) : Members();
}

/// Records what a client did or was refused before a bus, or counts it where the client repeats
/// `what`.
void AuditBook::record_or_count(std::string_view kind, const WhoRef& who, const Members& what,
                                const Members& details) {
    if (is_repeat(who, kind, what)) return;
    Members record = audit::record_of(kind, rt::wall_now());
    add_who(record, who);
    audit::add(record, what);
    audit::add(record, details);
    put(record);
}

std::function<void(const TopicRefusal&)> AuditBook::topic_refusals() {
    return [this, life = std::weak_ptr(alive_)](const TopicRefusal& refusal) {
        if (life.expired() || !is_heard()) return;
        AskedPlace place;
        place.station = refusal.station;
        if (refusal.station != nullptr) place.line = refusal.station->line;
        if (refusal.station != nullptr && refusal.point != nullptr)
            place.at = profile::format_notation(*refusal.station->configured->profile,
                                                refusal.point->table, refusal.point->address);
        Members what = members_of(place);
        what["method"] = "PUBLISH";
        add_text(what, "path", refusal.topic);
        what["outcome"] = "refused";
        what["status"] = refusal.why.status;
        record_or_count("refusal", refusal.who, what, {{"why", refusal.why.detail}});
    };
}

std::function<void(const WhoRef&, std::uint8_t, ByteView)> AuditBook::stray_writes() {
    return
        [this, life = std::weak_ptr(alive_)](const WhoRef& who, std::uint8_t unit, ByteView pdu) {
            if (life.expired() || !is_heard() || pdu.empty()) return;
            record_or_count("refusal", who,
                            {{"unit", unit}, {"function", pdu[0]}, {"outcome", "refused"}},
                            {{"pdu", to_hex(pdu, "")},
                             {"why", "the unit leads to no station that can be written"}});
        };
}

void AuditBook::reload(const web::ReloadVerdict& verdict) {
    if (!is_heard()) return;
    Members record = audit::record_of("reload", rt::wall_now());
    add_text(record, "cause", verdict.cause);
    record["rollback"] = verdict.rollback;
    add_text(record, "outcome", label(verdict.outcome));
    add_text(record, "why", verdict.why);
    add_some(record, "changes", verdict.changes);
    if (verdict.changes.size() > kChanges)
        record["more_changes"] = verdict.changes.size() - kChanges;
    if (!verdict.weaker.empty()) add_some(record, "weaker", verdict.weaker);
    if (!verdict.faults.empty()) record["faults"] = verdict.faults.size();
    put(record);
}

void AuditBook::tokens(const std::vector<web::Token>& before, const std::vector<web::Token>& now) {
    if (!is_heard()) return;
    for (const web::Token& token : now) {
        const auto old = std::ranges::find(before, token.name, &web::Token::name);
        if (old == before.end()) {
            record_token(token, "added");
        } else if (*old != token) {
            const bool other = old->hash != token.hash;
            record_token(token, old->standing != token.standing ? "role changed"
                                : other                         ? "replaced"
                                                                : "changed");
        }
    }
    for (const web::Token& token : before)
        if (std::ranges::find(now, token.name, &web::Token::name) == now.end())
            record_token(token, "removed");
}

void AuditBook::record_token(const web::Token& token, std::string_view event) {
    if (!is_heard()) return;
    Members record = audit::record_of("token", rt::wall_now());
    add_text(record, "token", token.name);
    add_text(record, "role", token.standing.name());
    record["event"] = event;
    if (token.expires) record["expires"] = web::expiry_text(*token.expires);
    put(record);
}

}  // namespace panelgate::gateway
