#include "line_doctor.hpp"

#include <string>

#include "panelgate/base/words.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::bus {
namespace {

doctor::LineFacts facts_of(const Settings& all) {
    const arbiter::Settings& settings = all.arbiter;
    doctor::LineFacts facts;
    facts.serial = settings.serial;
    facts.echo = settings.echo;
    facts.over_tcp = settings.may_stall;
    facts.deadline = settings.queue.deadline;
    facts.response_timeout = settings.unlisted.response_timeout;
    for (const arbiter::StationSettings& station : settings.stations) {
        facts.names[station.id] = name_of(all.stations, station.id);
        facts.response_timeouts[station.id] = station.response_timeout;
        if (station.crc_order == modbus::CrcOrder::high_first)
            facts.crc_high_first.insert(station.id);
    }
    return facts;
}

doctor::Sample sample_of(const LineCounts& counts) {
    doctor::Sample sample;
    for (const auto& [id, counters] : counts.stations) {
        sample.stations.emplace_hint(sample.stations.end(), id, counters.symptoms);
    }
    sample.broadcasts = counts.broadcasts;
    const line::Counters& line = counts.line.counters();
    sample.uart = line.uart;
    sample.telnet = line.telnet;
    return sample;
}

}  // namespace

LineDoctor::LineDoctor(const Settings& settings)
    : settings_(settings), doctor_(settings.doctor, facts_of(settings)) {}

void LineDoctor::apply() { doctor_.apply(facts_of(settings_)); }

void LineDoctor::begin(TimePoint now, const LineCounts& counts) {
    doctor_.begin(now, sample_of(counts));
}

void LineDoctor::look(TimePoint now, const LineCounts& counts) {
    if (doctor_.due(now)) judge(now, counts);
}

void LineDoctor::look_on_demand(TimePoint now, const LineCounts& counts) {
    if (doctor_.rested(now)) judge(now, counts);
}

void LineDoctor::on_line_down() {
    for (const doctor::Finding& finding : doctor_.withdraw_silence()) report_change(finding, false);
}

void LineDoctor::judge(TimePoint now, const LineCounts& counts) {
    const doctor::Doctor::Change change = doctor_.look(now, sample_of(counts));
    for (const doctor::Finding& finding : change.gone) report_change(finding, false);
    for (const doctor::Finding& finding : change.appeared) report_change(finding, true);
}

void LineDoctor::report_change(const doctor::Finding& finding, bool is_new) const {
    const std::string cause(code(finding.cause));
    const std::string station =
        finding.station ? name_of(settings_.stations, *finding.station) : std::string(kAllStations);
    if (is_new) {
        rt::log(rt::LogLevel::warn, "line finding",
                {{"line", settings_.name},
                 {"cause", cause},
                 {"station", station},
                 {"evidence", finding.evidence},
                 {"advice", finding.advice}});
    } else {
        rt::log(rt::LogLevel::info, "line finding gone",
                {{"line", settings_.name}, {"cause", cause}, {"station", station}});
    }
    if (!settings_.observe) return;
    const std::string what = is_new ? "finding: " : "finding gone: ";
    settings_.observe(
        LineEvent{true, what + cause + ", station " + station, finding.station.value_or(0)});
}

std::vector<FindingReport> LineDoctor::report() const {
    std::vector<FindingReport> list;
    for (const doctor::Finding& f : doctor_.findings())
        list.push_back({std::string(code(f.cause)), f.station
                                                        ? name_of(settings_.stations, *f.station)
                                                        : std::string(kAllStations)});
    return list;
}

std::vector<LineFinding> LineDoctor::findings() const {
    std::vector<LineFinding> list;
    for (const doctor::Finding& f : doctor_.findings()) {
        list.push_back(
            {std::string(code(f.cause)), f.station, f.text, f.advice, f.evidence, {}, f.figures});
        if (f.station) list.back().name = name_of(settings_.stations, *f.station);
    }
    return list;
}

}  // namespace panelgate::bus
