#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/modbus/function.hpp"
#include "panelgate/modbus/request.hpp"
#include "plan.hpp"
#include "subject.hpp"

namespace panelgate::scenario {

using arbiter::Action;
using arbiter::Finish;
using arbiter::Job;
using arbiter::Transmit;

/// Changes what a good arbiter says.
class Tampered : public Subject {
  public:
    using Subject::Subject;

    Result<arbiter::Ticket> submit(TimePoint now, Job job) override {
        auto ticket = Subject::submit(now, job);
        if (ticket) jobs_.insert_or_assign(*ticket, std::move(job));
        return ticket;
    }
    std::optional<Action> poll_action(TimePoint now) override {
        if (!extra_.empty()) {
            Action action = std::move(extra_.front());
            extra_.erase(extra_.begin());
            return action;
        }
        while (auto action = Subject::poll_action(now)) {
            if (auto* finish = std::get_if<Finish>(&*action)) {
                if (!tamper(now, *finish)) continue;
            } else if (auto* transmit = std::get_if<Transmit>(&*action)) {
                tamper(now, *transmit);
            }
            return action;
        }
        return std::nullopt;
    }

  protected:
    /// False: it is held back.
    virtual bool tamper(TimePoint now, Finish& finish) {
        static_cast<void>(now);
        static_cast<void>(finish);
        return true;
    }
    virtual void tamper(TimePoint now, Transmit& transmit) {
        static_cast<void>(now);
        static_cast<void>(transmit);
    }
    const Job& job_of(const Finish& finish) const { return jobs_.at(finish.ticket); }
    static bool is_good(const Finish& finish) {
        return finish.pdu && !modbus::exception_of(*finish.pdu);
    }
    bool is_read(const Finish& finish) const { return job_of(finish).request.is_read(); }

    std::vector<Action> extra_;
    std::map<arbiter::Ticket, Job> jobs_;
};

using Make = std::function<std::unique_ptr<Subject>(arbiter::Settings)>;
using Change = std::function<void(arbiter::Settings&)>;
using Shape = std::function<void(Plan&)>;

struct Mutant {
    const char* name;
    const char* caught_as;
    Kind kind;
    Make make;
    Shape shape = [](Plan&) {};
    SerialMode mode = SerialMode::rtu;
};

template <class T>
Make tampered() {
    return [](const arbiter::Settings& settings) { return std::make_unique<T>(settings); };
}

/// A whole arbiter, told something else than what is true.
inline Make misled(Change change) {
    return [change = std::move(change)](arbiter::Settings settings) {
        change(settings);
        return std::make_unique<Subject>(settings);
    };
}

void each_station(arbiter::Settings& settings, const auto& change) {
    change(settings.unlisted);
    for (arbiter::StationSettings& station : settings.stations) change(station);
}

/// Plays the plans of its kind until one shows it. Nothing when that was as it is to be caught;
/// else what was found instead.
std::string not_caught(const Mutant& mutant);

}  // namespace panelgate::scenario
