#include "line_doctor.hpp"

#include <string>

#include "panelgate/rt/log.hpp"

namespace panelgate::bus {
namespace {

doctor::LineFacts facts_of(const arbiter::Settings& settings) {
    doctor::LineFacts facts;
    facts.serial = settings.serial;
    facts.echo = settings.echo;
    facts.over_tcp = settings.may_stall;
    facts.deadline = settings.queue.deadline;
    facts.response_timeout = settings.unlisted.response_timeout;
    for (const arbiter::StationSettings& station : settings.stations) {
        facts.response_timeouts[station.id] = station.response_timeout;
        if (station.crc_order == modbus::CrcOrder::high_first)
            facts.crc_high_first.insert(station.id);
    }
    return facts;
}

doctor::Sample sample_of(const arbiter::Arbiter& arbiter, line::Line& line) {
    doctor::Sample sample;
    for (const auto& [id, counters] : arbiter.station_counters()) {
        sample.stations.emplace_hint(sample.stations.end(), id, counters.symptoms);
    }
    sample.broadcasts = arbiter.counters().broadcasts;
    sample.uart = line.counters().uart;
    return sample;
}

}  // namespace

LineDoctor::LineDoctor(const Settings& settings)
    : settings_(settings), doctor_(settings.doctor, facts_of(settings.arbiter)) {}

void LineDoctor::begin(TimePoint now, const arbiter::Arbiter& arbiter, line::Line& line) {
    doctor_.begin(now, sample_of(arbiter, line));
}

void LineDoctor::look(TimePoint now, const arbiter::Arbiter& arbiter, line::Line& line) {
    if (doctor_.due(now)) judge(now, arbiter, line);
}

void LineDoctor::glance(TimePoint now, const arbiter::Arbiter& arbiter, line::Line& line) {
    if (doctor_.rested(now)) judge(now, arbiter, line);
}

void LineDoctor::judge(TimePoint now, const arbiter::Arbiter& arbiter, line::Line& line) {
    const doctor::Doctor::Change change = doctor_.look(now, sample_of(arbiter, line));
    for (const doctor::Finding& finding : change.gone) say(finding, false);
    for (const doctor::Finding& finding : change.appeared) say(finding, true);
}

void LineDoctor::say(const doctor::Finding& finding, bool is_new) const {
    const std::string cause(code(finding.cause));
    const std::string station =
        finding.station ? name_of(settings_.stations, *finding.station) : "all";
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
    settings_.observe(LineEvent{true, what + cause + ", station " + station});
}

std::vector<LineFinding> LineDoctor::findings() const {
    std::vector<LineFinding> list;
    for (const doctor::Finding& f : doctor_.findings()) {
        list.push_back({std::string(code(f.cause)), f.station, f.text, f.advice, f.evidence});
    }
    return list;
}

}  // namespace panelgate::bus
