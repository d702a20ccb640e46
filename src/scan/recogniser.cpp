#include "recogniser.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "attempt.hpp"
#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"
#include "panelgate/profile/judge.hpp"

namespace panelgate::scan {

namespace {

using modbus::ExceptionCode;
using profile::PanelProfile;

constexpr const char* kGeneric = "generic";
constexpr std::size_t kMaxProbes = 256;  // to choose from
constexpr std::size_t kMaxAsked = 24;
constexpr std::uint32_t kLastAddress = 0xFFFF;

bool may_be(const PanelProfile& profile, std::uint8_t station,
            const std::optional<SerialFormat>& format, modbus::CrcOrder order) {
    if (profile.crc_order != order) return false;
    if (station < profile.first_station || station > profile.last_station) return false;
    return !format || offers(profile, *format);
}

bool is_read(const Bytes& pdu) {
    const auto request = modbus::Request::make(pdu, modbus::QuantityCheck::wide);
    return request && request->is_read();
}

void add_probe(std::vector<Bytes>& probes, const Bytes& pdu) {
    if (probes.size() == kMaxProbes || !is_read(pdu)) return;
    append_new(probes, pdu);
}

std::vector<Bytes> identifications(const PanelProfile& profile) {
    std::vector<Bytes> reads;
    reads.reserve(profile.identification.size());
    for (const profile::Identification& how : profile.identification) reads.push_back(how.request);
    return reads;
}

/// Returns reads of the last item of each area and of the item after it.
std::vector<Bytes> boundaries(const PanelProfile& profile) {
    std::vector<Bytes> reads;
    for (const profile::Area& area : profile.areas) {
        std::vector<modbus::Table> tables = area.also;
        tables.insert(tables.begin(), area.table);
        for (const modbus::Table table : tables) {
            for (const std::uint32_t at : {area.readable.last, area.readable.last + 1}) {
                if (at > kLastAddress) continue;
                reads.push_back(modbus::encode_read(table, static_cast<std::uint16_t>(at), 1));
            }
        }
    }
    return reads;
}

/// True if the reply begins as the profile says for this read; nullopt if it is not an
/// identification of this profile.
std::optional<bool> identifies(const PanelProfile& profile, const Bytes& probe,
                               const std::optional<Bytes>& reply) {
    std::optional<bool> fits;
    for (const profile::Identification& how : profile.identification) {
        if (how.request != probe) continue;
        const bool begins =
            reply && std::ranges::mismatch(how.reply, *reply).in1 == how.reply.end();
        fits = fits.value_or(true) && begins;
    }
    return fits;
}

bool is_data(const Bytes& reply) {
    return !reply.empty() && (reply[0] & modbus::kExceptionBit) == 0;
}

}  // namespace

Recogniser::Recogniser(const profile::Catalogue& profiles, std::uint8_t station,
                       const std::optional<SerialFormat>& format, modbus::CrcOrder order) {
    for (const auto& [name, profile] : profiles.all()) {
        if (name == kGeneric) {
            generic_ = true;
        } else if (may_be(profile, station, format, order)) {
            matches_.push_back({&profile});
        }
    }
    for (const ProfileMatch& match : matches_) {
        for (const Bytes& probe : identifications(*match.profile)) add_probe(probes_, probe);
    }
    for (const ProfileMatch& match : matches_) {
        for (const Bytes& probe : boundaries(*match.profile)) add_probe(probes_, probe);
    }
}

Recogniser::Answer Recogniser::expected(const PanelProfile& profile, const Bytes& probe) {
    const profile::Judgement judgement = profile::judge(profile, probe);
    if (judgement == profile::Judgement::fine) return Answer::granted;
    return judgement == profile::Judgement::illegal_function ? Answer::no_function
                                                             : Answer::refused;
}

/// Returns nullopt if the reply does not show what the station supports: silence, busy, a failure,
/// a vendor's code.
std::optional<Recogniser::Answer> Recogniser::classify(const std::optional<Bytes>& reply) {
    if (!reply) return std::nullopt;
    const auto code = modbus::exception_of(*reply);
    if (!code) return Answer::granted;
    const auto known = static_cast<ExceptionCode>(*code);
    if (known == ExceptionCode::illegal_function) return Answer::no_function;
    const bool about_items =
        known == ExceptionCode::illegal_data_address || known == ExceptionCode::illegal_data_value;
    return about_items ? std::optional(Answer::refused) : std::nullopt;
}

/// A panel's identification weighs more than where its memory ends, which varies within a family.
bool Recogniser::is_viable(const ProfileMatch& match) const {
    if (!match.possible) return false;
    return match.differed == 0 || (match.by_content && match.differed * 2 < match.agreed);
}

bool Recogniser::is_asked(const Bytes& probe) const {
    return std::ranges::find(asked_, probe) != asked_.end();
}

std::optional<Bytes> Recogniser::next_probe() const {
    if (asked_.size() >= kMaxAsked) return std::nullopt;
    if (auto split = best_split()) return split;
    return confirmation();
}

/// Returns the read that leaves the fewest candidates in the worse of its two cases.
std::optional<Bytes> Recogniser::best_split() const {
    const Bytes* best = nullptr;
    std::ptrdiff_t least = std::ranges::count_if(
        matches_, [this](const ProfileMatch& match) { return is_viable(match); });
    for (const Bytes& probe : probes_) {
        if (is_asked(probe)) continue;
        std::ptrdiff_t granted = 0;
        std::ptrdiff_t refused = 0;
        for (const ProfileMatch& match : matches_) {
            if (!is_viable(match)) continue;
            ++(expected(*match.profile, probe) == Answer::granted ? granted : refused);
        }
        if (std::max(granted, refused) >= least) continue;
        least = std::max(granted, refused);
        best = &probe;
    }
    return best == nullptr ? std::nullopt : std::optional(*best);
}

std::optional<Bytes> Recogniser::confirmation() const {
    for (const ProfileMatch& match : matches_) {
        if (!is_viable(match)) continue;
        std::vector<Bytes> reads = identifications(*match.profile);
        std::ranges::move(boundaries(*match.profile), std::back_inserter(reads));
        for (const Bytes& read : reads) {
            if (is_read(read) && !is_asked(read)) return read;
        }
    }
    return std::nullopt;
}

void Recogniser::on_reply(const Bytes& probe, const std::optional<Bytes>& reply) {
    asked_.push_back(probe);
    for (ProfileMatch& match : matches_) judge(match, probe, reply);
}

void Recogniser::skip(const Bytes& probe) { asked_.push_back(probe); }

void Recogniser::judge(ProfileMatch& match, const Bytes& probe,
                       const std::optional<Bytes>& reply) const {
    if (const auto fits = identifies(*match.profile, probe, reply)) {
        match.possible = match.possible && *fits;
        match.by_content = match.by_content || (*fits && reply && is_data(*reply));
    }
    const auto answer = classify(reply);
    if (!answer) return;
    const Answer manual = expected(*match.profile, probe);
    if (*answer == manual) ++match.exact_matches;
    if ((*answer == Answer::granted) == (manual == Answer::granted)) {
        ++match.agreed;
        return;
    }
    ++match.differed;
    const bool about_function = *answer == Answer::no_function || manual == Answer::no_function;
    if (about_function) match.possible = false;
}

std::vector<Candidate> Recogniser::candidates() const {
    std::vector<ProfileMatch> order = matches_;
    std::ranges::sort(order, [](const ProfileMatch& a, const ProfileMatch& b) {
        if (a.by_content != b.by_content) return a.by_content;
        if (a.differed != b.differed) return a.differed < b.differed;
        if (a.exact_matches != b.exact_matches) return a.exact_matches > b.exact_matches;
        return a.profile->name < b.profile->name;
    });
    std::vector<Candidate> found;
    for (const ProfileMatch& match : order) {
        if (!is_viable(match) || match.agreed == 0) continue;
        std::string why;
        for (const profile::Identification& how : match.profile->identification) {
            if (is_asked(how.request)) why += how.means + "; ";
        }
        why += std::to_string(match.agreed) + " of " +
               std::to_string(match.agreed + match.differed) + " reads as its manual says";
        found.push_back({match.profile->name, std::move(why)});
    }
    if (!found.empty() || !generic_) return found;
    std::string why = "no panel profile fits";
    const auto nearest = std::ranges::min_element(order, std::less(), &ProfileMatch::differed);
    if (nearest != order.end() && nearest->agreed > nearest->differed) {
        const ProfileMatch& near = *nearest;
        why += "; " + near.profile->name + " is nearest, " + std::to_string(near.agreed) + " of " +
               std::to_string(near.agreed + near.differed) + " reads as its manual says";
    }
    return {{kGeneric, std::move(why)}};
}

namespace {

constexpr unsigned kSilentChecks = 3;
constexpr unsigned kSilentProbes = 2;

}  // namespace

Bytes first_request() { return modbus::encode_read(modbus::Table::holding_registers, 0, 1); }

Examination::Examination(const profile::Catalogue& profiles, const Settings& settings,
                         std::uint8_t station, const std::optional<SerialFormat>& format,
                         modbus::CrcOrder order)
    : settings_(settings), recogniser_(profiles, station, format, order) {
    finding_.station = station;
    finding_.crc_order = order;
}

/// True while the first request is to be repeated. Damage can be noise, or two panels replying at
/// once: more repetitions tell which.
bool Examination::repeats() const {
    if (checks_ < settings_.repeats) return silent_ < kSilentChecks;
    const Evidence& seen = finding_.evidence;
    return seen.damaged > 0 && seen.twice == 0 && checks_ < settings_.most_repeats;
}

std::optional<Ask> Examination::next() {
    if (!probe_ && repeats()) {
        ++checks_;
        return make_ask(first_request(), settings_.settle);
    }
    if (finding_.evidence.good == 0) return std::nullopt;
    while (true) {
        if (!probe_) {
            probe_ = recogniser_.next_probe();
            tries_ = 0;
        }
        if (!probe_) return std::nullopt;
        ++tries_;
        if (auto wanted = make_ask(*probe_, settings_.quiet)) return wanted;
        recogniser_.skip(*probe_);
        probe_.reset();
    }
}

/// Returns nullopt if the PDU is not a pure read.
std::optional<Ask> Examination::make_ask(const Bytes& pdu, Duration settle) const {
    const auto request = ReadRequest::make(station(), pdu, finding_.crc_order);
    if (!request) return std::nullopt;
    return Ask{*request, {settings_.second_timeout, settle}};
}

void Examination::count(const Outcome& outcome) {
    Evidence& seen = finding_.evidence;
    ++seen.asked;
    if (outcome.with_damage) ++seen.damaged;
    for (unsigned i = 0; i < outcome.more; ++i) {
        if (outstanding_ > 0) {
            --outstanding_;
            ++seen.late;
        } else {
            ++seen.twice;
        }
    }
    switch (outcome.kind) {
        case Outcome::Kind::silent:
            ++silent_;
            ++outstanding_;
            return;
        case Outcome::Kind::replied:
            ++seen.good;
            break;
        case Outcome::Kind::damaged:
            ++seen.damaged;
            break;
    }
    silent_ = 0;
}

void Examination::compare(const Bytes& reply) {
    const bool refused = modbus::exception_of(reply).has_value();
    if (refused_ && *refused_ != refused) finding_.evidence.mixed = true;
    refused_ = refused;
}

void Examination::on_outcome(const Outcome& outcome) {
    count(outcome);
    before_last_ = std::exchange(last_, probe_.value_or(first_request()));
    const bool replied = outcome.kind == Outcome::Kind::replied;
    if (!probe_) {
        if (replied) compare(outcome.reply);
        return;
    }
    const bool damaged = outcome.kind == Outcome::Kind::damaged;
    if (!replied && tries_ < (damaged ? settings_.damaged_tries : kSilentProbes)) return;
    const Bytes probe = std::move(*probe_);
    probe_.reset();
    if (damaged) {
        recogniser_.skip(probe);
    } else {
        recogniser_.on_reply(probe, replied ? std::optional(outcome.reply) : std::nullopt);
    }
}

bool Examination::on_unsolicited(const Frame& frame) {
    if (frame.crc_order != finding_.crc_order) return false;
    const bool late = outstanding_ > 0;
    if (!late && !modbus::answers(last_, frame.pdu) && !modbus::answers(before_last_, frame.pdu))
        return false;
    if (late) --outstanding_;
    ++(late ? finding_.evidence.late : finding_.evidence.twice);
    return true;
}

StationFinding Examination::finding() const {
    StationFinding finding = finding_;
    if (finding.evidence.good > 0) finding.candidates = recogniser_.candidates();
    return finding;
}

}  // namespace panelgate::scan
