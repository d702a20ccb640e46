// watch: a line at each change of places of a running gateway.
#include <boost/json/parse.hpp>
#include <boost/json/value.hpp>
#include <cstddef>
#include <iostream>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "commands.hpp"
#include "gateway_client.hpp"
#include "output.hpp"
#include "panelgate/rt/clock.hpp"
#include "table.hpp"

namespace panelgate::commands {

namespace {

constexpr auto kBetweenReads =
    1s;  // between readings, and before a gateway that is gone is asked again

class Watch {
  public:
    Watch(const GatewayClient& gateway, std::vector<GatewayPlace> places,
          const WatchOptions& options)
        : gateway_(gateway), places_(std::move(places)), left_(options.count) {
        shown_.resize(places_.size());
        counted_ = options.count > 0;
        if (!options.type.empty()) query_ = "?type=" + escaped(options.type);
        if (!options.order.empty())
            query_ += (query_.empty() ? "?order=" : "&order=") + escaped(options.order);
    }

    ExitCode run() {
        const bool streams = events_path().has_value();
        while (!(streams ? follow() : read_all())) {
            if (code_ != kFine) return code_;
            std::this_thread::sleep_for(kBetweenReads);
        }
        return kFine;
    }

  private:
    /// Of the events stream, if all places are points.
    std::optional<std::string> events_path() const {
        std::string names;
        for (const GatewayPlace& place : places_) {
            if (place.target.kind != PlaceKind::point) return std::nullopt;
            names += (names.empty() ? "" : ",") + escaped(place.station + '/' + place.place);
        }
        return "/api/v1/events?types=point&point=" + names;
    }

    /// True when enough lines are printed.
    bool show(std::size_t index, const std::string& text) {
        if (shown_[index] == text) return false;
        shown_[index] = text;
        std::cout << rfc3339(rt::wall_now()).substr(0, kSeconds) + "Z  " +
                         places_[index].target.shown + "  " + text + '\n'
                  << std::flush;
        if (!std::cout) end_without_output();
        return counted_ && --left_ == 0;
    }

    /// A gateway that never answered is an error; one that is gone is waited for.
    void say_gone(const GatewayAnswer& answer) {
        if (!was_there_) {
            code_ = gateway_.explain(answer);
        } else if (!std::exchange(gone_, true)) {
            std::cerr << "panelgate: " << gateway_.reason(answer) << "; waiting for it\n";
        }
    }

    /// Reads every place once; true when enough lines are printed.
    bool read_all() {
        for (std::size_t i = 0; i < places_.size(); ++i) {
            const GatewayPlace& place = places_[i];
            const bool is_point = place.target.kind == PlaceKind::point;
            const auto answer = gateway_.get(place.target.path + (is_point ? "" : query_));
            if (answer.status == 0) {
                say_gone(answer);
                return false;
            }
            if (!answer.is_ok() && (!was_there_ || answer.status == 401)) {
                if (is_lasting(answer)) {
                    code_ = explain_place(gateway_, place, answer, "read");
                    return false;
                }
            }
            gone_ = false;
            if (show(i, shown_answer(answer, is_point))) return true;
        }
        was_there_ = true;
        return false;
    }

    /// A refusal that asking again does not change.
    static bool is_lasting(const GatewayAnswer& answer) {
        return answer.status >= 400 && answer.status < 500 && answer.problem() != "exception";
    }

    std::string shown_answer(const GatewayAnswer& answer, bool is_point) const {
        if (!answer.is_ok()) return "cannot be read: " + gateway_.reason(answer);
        if (is_point) return point_text(answer.json);
        const boost::json::value* values = answer.json.if_contains("values");
        return values != nullptr ? value_text(*values) : "no value";
    }

    bool follow() {
        bool enough = false;
        const auto ended = gateway_.follow(
            *events_path(), [&] { return (enough = read_all()) || code_ != kFine; },
            [&](const Event& event) { return enough = take(event); });
        if (!ended) return enough;
        if (ended->is_ok()) return false;  // long enough: once more
        if (ended->status == 0)
            say_gone(*ended);
        else
            code_ = gateway_.explain(*ended);
        return false;
    }

    bool take(const Event& event) {
        boost::system::error_code wrong;
        const boost::json::value value = boost::json::parse(event.data, wrong);
        if (wrong || !value.is_object()) return false;
        const auto& point = value.get_object();
        for (std::size_t i = 0; i < places_.size(); ++i) {
            const bool is_it = text_of(point, "station") == places_[i].station &&
                               text_of(point, "name") == places_[i].place;
            if (is_it && show(i, point_text(point))) return true;
        }
        return false;
    }

    static constexpr std::size_t kSeconds = 19;  // characters of a time up to its seconds

    const GatewayClient& gateway_;
    std::vector<GatewayPlace> places_;
    std::string query_;
    std::vector<std::optional<std::string>> shown_;
    bool counted_ = false;
    unsigned left_ = 0;
    bool was_there_ = false;
    bool gone_ = false;
    ExitCode code_ = kFine;
};

ExitCode refuse_words(const std::string& what) {
    std::cerr << "panelgate: " << what << '\n';
    return kUsage;
}

std::vector<std::string> names_of(const std::vector<Station>& stations) {
    std::vector<std::string> names;
    for (const Station& station : stations)
        if (!station.name.empty()) names.push_back(station.name);
    return names;
}

}  // namespace

ExitCode watch(const GatewayOptions& at, const WatchOptions& options) {
    Places places = places_of(options.words);
    if (!places.wrong.empty()) return refuse_words(places.wrong);
    end_with_signals();
    ExitCode code = kFine;
    const auto gateway = GatewayClient::make(at, code);
    if (!gateway) return code;
    const auto stations = all_stations(*gateway, code);
    if (!stations) return code;
    places = places_of(options.words, names_of(*stations));
    if (!places.wrong.empty()) return refuse_words(places.wrong);
    std::vector<GatewayPlace> found;
    for (const Place& typed : places.list) {
        auto place = find_place(*gateway, typed, code);
        if (!place) return code;
        if (!may_have_type(*place, !options.type.empty() || !options.order.empty())) return kUsage;
        found.push_back(std::move(*place));
    }
    return Watch(*gateway, std::move(found), options).run();
}

}  // namespace panelgate::commands
