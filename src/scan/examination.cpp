#include "examination.hpp"

#include <utility>

#include "panelgate/modbus/exception.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/response.hpp"

namespace panelgate::scan {
namespace {

constexpr unsigned kSilentChecks = 3;
constexpr unsigned kSilentProbes = 2;

}  // namespace

Bytes first_question() { return modbus::encode_read(modbus::Table::holding_registers, 0, 1); }

Examination::Examination(const profile::Catalogue& profiles, const Settings& settings,
                         std::uint8_t station, const std::optional<SerialFormat>& format,
                         modbus::CrcOrder order)
    : settings_(settings), recogniser_(profiles, station, format, order) {
    finding_.station = station;
    finding_.crc_order = order;
}

/// Damage can be noise, or two panels that always speak together: more of the same tells.
bool Examination::repeats() const {
    if (checks_ < settings_.repeats) return silent_ < kSilentChecks;
    const Evidence& seen = finding_.evidence;
    return seen.damaged > 0 && seen.twice == 0 && checks_ < settings_.most_repeats;
}

std::optional<Ask> Examination::next() {
    if (!probe_ && repeats()) {
        ++checks_;
        return make_ask(first_question(), settings_.settle);
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

/// Nothing when it is no read.
std::optional<Ask> Examination::make_ask(const Bytes& pdu, Duration settle) const {
    const auto request = ReadRequest::make(station(), pdu, finding_.crc_order);
    if (!request) return std::nullopt;
    return Ask{*request, {settings_.second_timeout, settle}};
}

void Examination::count(const Outcome& outcome) {
    Evidence& seen = finding_.evidence;
    ++seen.asked;
    if (outcome.torn) ++seen.damaged;
    for (unsigned i = 0; i < outcome.more; ++i) {
        if (owed_ > 0) {
            --owed_;
            ++seen.late;
        } else {
            ++seen.twice;
        }
    }
    switch (outcome.kind) {
        case Outcome::Kind::silent:
            ++silent_;
            ++owed_;
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
    before_last_ = std::exchange(last_, probe_.value_or(first_question()));
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

bool Examination::on_stray(const Frame& frame) {
    if (frame.crc_order != finding_.crc_order) return false;
    const bool late = owed_ > 0;
    if (!late && !modbus::answers(last_, frame.pdu) && !modbus::answers(before_last_, frame.pdu))
        return false;
    if (late) --owed_;
    ++(late ? finding_.evidence.late : finding_.evidence.twice);
    return true;
}

StationFinding Examination::finding() const {
    StationFinding finding = finding_;
    if (finding.evidence.good > 0) finding.candidates = recogniser_.candidates();
    return finding;
}

}  // namespace panelgate::scan
