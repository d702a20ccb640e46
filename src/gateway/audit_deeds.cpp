// What an audit records of clients' deeds besides writes: refusals, log-ins, reloads, tokens.
#include <algorithm>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/value.hpp>
#include <span>
#include <utility>

#include "panelgate/gateway/asked_place.hpp"
#include "panelgate/gateway/audit_book.hpp"
#include "panelgate/gateway/northbound.hpp"
#include "panelgate/gateway/snapshot.hpp"
#include "panelgate/profile/notation.hpp"

namespace panelgate::gateway {

namespace {

using audit::Kind;
using audit::member;

/// The text of a member of a problem (RFC 9457), such as `detail`; "" if it has none.
std::string text_in(std::string_view body, std::string_view key) {
    boost::system::error_code wrong;
    const boost::json::value value = boost::json::parse(body, wrong);
    const auto* object = wrong ? nullptr : value.if_object();
    const auto* found = object != nullptr ? object->if_contains(key) : nullptr;
    const auto* text = found != nullptr ? found->if_string() : nullptr;
    return text != nullptr ? std::string(*text) : std::string();
}

}  // namespace

std::function<void(const web::Deed&)> AuditBook::deeds() {
    return [this, life = std::weak_ptr(alive_)](const web::Deed& what) {
        if (!life.expired()) deed(what);
    };
}

void AuditBook::deed(const web::Deed& deed) {
    if (!trail_) return;
    // A write has one record: the bus records refusals of its own.
    const bool is_told = std::exchange(refused_, nullptr) == deed.who && deed.who != nullptr;
    const bool discovers = deed.path.ends_with("/discover");
    const bool simulates = deed.path.find("/simulator/") != deed.path.npos;
    if ((deed.status == 401 || deed.status == 429) && deed.shown_token) {
        // Failed log-ins are counted by client alone, so that each client has a place of its own.
        if (is_repeat(
                deed.who, "login", 1, [&] { return member("outcome", "log-in failed"); }, false))
            return;
        begin(Kind::login);
        add_who(deed.who);
        composer_.text("outcome", "failed").text("path", deed.path);
        composer_.text("why", text_in(deed.answer, "detail"));
    } else if (deed.status >= 400) {
        if (!is_told) refusal(deed);
        return;
    } else if (discovers || simulates) {
        begin(discovers ? Kind::discovery : Kind::simulator);
        add_who(deed.who);
        composer_.members(place_of(deed));
        composer_.text("method", deed.method).text("path", deed.path).text("body", deed.body);
    } else {
        return;  // the bus tells of writes, the reloader of reloads
    }
    record();
}

std::string AuditBook::place_of(const web::Deed& deed) const {
    return snapshot_ ? members_of(asked_place(snapshot_->plant, deed.path, deed.body))
                     : std::string();
}

/// Records refusals before a bus. A bus records refusals of its own, and the reloader records
/// reloads.
void AuditBook::refusal(const web::Deed& deed) {
    const bool lacks_right = deed.status == 401 || deed.status == 403;
    const bool is_refusal = lacks_right || deed.status == 409 || deed.status == 422;
    const bool is_reload = deed.path.ends_with("/reload") && !lacks_right;
    if (!is_refusal || is_reload) return;
    const std::string rule = text_in(deed.answer, "rule");
    Refused refused{deed.who, place_of(deed), std::string(deed.method), std::string(deed.path)};
    refused.body = deed.body;
    refused.status = deed.status;
    refused.rule = rule.empty() ? rule : member("rule", rule);
    refused.why = text_in(deed.answer, "detail");
    record_refusal(refused);
}

void AuditBook::record_refusal(const Refused& refused) {
    std::string& what = what_;
    what = refused.method;
    what += '\t';
    what += std::to_string(refused.status);
    what += '\t';
    what += refused.path;
    if (is_repeat(refused.who, what, 1, [&] {
            return refused.place + member("method", refused.method) + member("path", refused.path) +
                   member("outcome", "refused") + refused.rule;
        }))
        return;
    begin(Kind::refusal);
    add_who(refused.who);
    composer_.members(refused.place).text("method", refused.method).text("path", refused.path);
    composer_.text("body", refused.body).text("outcome", "refused").members(refused.rule);
    composer_.number("status", refused.status).text("why", refused.why);
    record();
}

std::function<void(const TopicRefusal&)> AuditBook::topic_refusals() {
    return [this, life = std::weak_ptr(alive_)](const TopicRefusal& refusal) {
        if (life.expired() || !trail_) return;
        AskedPlace place;
        place.station = refusal.station;
        if (refusal.station != nullptr) place.line = refusal.station->line;
        if (refusal.station != nullptr && refusal.point != nullptr)
            place.at = profile::format_notation(*refusal.station->configured->profile,
                                                refusal.point->table, refusal.point->address);
        Refused refused{refusal.who, members_of(place), "PUBLISH", std::string(refusal.topic)};
        refused.status = refusal.why.status;
        refused.why = refusal.why.detail;
        record_refusal(refused);
    };
}

std::function<void(const WhoRef&, std::uint8_t, ByteView)> AuditBook::stray_writes() {
    return [this, life = std::weak_ptr(alive_)](const WhoRef& who, std::uint8_t unit,
                                                ByteView pdu) {
        if (life.expired() || !trail_ || pdu.empty()) return;
        what_ = "unit\t" + std::to_string(unit) + '\t' + std::to_string(pdu[0]);
        const auto members = [&](audit::Composer& record) {
            record.number("unit", unit).number("function", pdu[0]).word("outcome", "refused");
        };
        if (is_repeat(who, what_, 1, [&] { return audit::members_by(members); })) return;
        begin(Kind::refusal);
        add_who(who);
        members(composer_);
        composer_.hex("pdu", pdu).text("why", "the unit leads to no station that can be written");
        record();
    };
}

void AuditBook::reload(const web::ReloadVerdict& verdict) {
    if (!trail_) return;
    begin(Kind::reload).text("cause", verdict.cause).flag("rollback", verdict.rollback);
    composer_.text("outcome", label(verdict.outcome)).text("why", verdict.why);
    const std::span<const std::string> changes(verdict.changes);
    composer_.texts("changes", changes.first(std::min(changes.size(), kChanges)));
    if (changes.size() > kChanges) composer_.number("more_changes", changes.size() - kChanges);
    const std::span<const std::string> weaker(verdict.weaker);
    if (!weaker.empty()) composer_.texts("weaker", weaker.first(std::min(weaker.size(), kChanges)));
    if (!verdict.faults.empty()) composer_.number("faults", verdict.faults.size());
    record();
}

void AuditBook::tokens(const std::vector<web::Token>& before, const std::vector<web::Token>& now) {
    if (!trail_) return;
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

void AuditBook::expired(const web::Token& token) {
    if (trail_) record_token(token, "expired");
}

void AuditBook::record_token(const web::Token& token, std::string_view event) {
    begin(Kind::token).text("token", token.name).text("role", token.standing.name());
    composer_.text("event", event);
    if (token.expires) composer_.text("expires", web::expiry_text(*token.expires));
    record();
}

}  // namespace panelgate::gateway
