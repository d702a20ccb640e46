#include "gateway_client.hpp"

#include <unistd.h>
#include <algorithm>
#include <boost/json/parse.hpp>
#include <boost/json/value.hpp>
#include <charconv>
#include <csignal>
#include <cstddef>
#include <fstream>
#include <iostream>
#include <utility>
#include <variant>

#include "panelgate/base/network.hpp"
#include "panelgate/base/text.hpp"
#include "table.hpp"

namespace panelgate::commands {

void end_with_signals() {
    const auto end = [](int) { ::_exit(kFine); };
    std::signal(SIGINT, end);
    std::signal(SIGTERM, end);
}

namespace {

constexpr std::size_t kMostOfAnswer = 64 * 1024 * 1024;  // bytes of an answer
constexpr std::size_t kMostEvents = 1024 * 1024;  // bytes of a stream, before it is opened anew
constexpr Duration kStream = 600s;                // the same in time

}  // namespace

std::optional<std::string> token_in(const std::string& file) {
    if (file.empty()) return "";
    std::ifstream in(file);
    std::string line;
    std::getline(in, line);
    std::string token(trimmed(std::string_view(line).substr(0, line.find('\r'))));
    const auto is_visible = [](char c) { return c > ' ' && c < '\x7f'; };  // as in a header
    if (!token.empty() && std::ranges::all_of(token, is_visible)) return token;
    std::cerr << "panelgate: no token can be read from " << file
              << " (its first line is one, of visible ASCII characters)\n";
    return std::nullopt;
}

std::string GatewayAnswer::problem() const {
    const std::string type = text_of(json, "type");
    return type.substr(type.rfind(':') + 1);
}

std::optional<GatewayClient> GatewayClient::make(const GatewayOptions& options, ExitCode& code) {
    auto found = http_door(options);
    if (const auto* none = std::get_if<NoHttpDoor>(&found)) {
        std::cerr << "panelgate: " << none->why << '\n';
        code = none->code;
        return std::nullopt;
    }
    auto token = token_in(options.token_file);
    if (!token) {
        code = kNoInput;
        return std::nullopt;
    }
    GatewayClient client;
    client.door_ = std::get<HttpDoor>(std::move(found));
    client.token_ = std::move(*token);
    client.token_file_ = options.token_file;
    return client;
}

std::string GatewayClient::without_token(std::string text) const {
    constexpr std::string_view kLeftOut = "(left out)";
    if (token_.empty()) return text;
    for (std::size_t at = text.find(token_); at != text.npos;
         at = text.find(token_, at + kLeftOut.size()))
        text.replace(at, token_.size(), kLeftOut);
    return text;
}

std::string GatewayClient::request(const std::string& verb, const std::string& path,
                                   const std::string& body) const {
    std::string made = verb + ' ' + path + " HTTP/1.1\r\nHost: " +
                       endpoint_text(door_.endpoint.address, door_.endpoint.port);
    if (!token_.empty()) made += "\r\nAuthorization: Bearer " + token_;
    if (verb != "GET")
        made +=
            "\r\nContent-Type: application/json\r\nContent-Length: " + std::to_string(body.size());
    return made + "\r\nConnection: close\r\n\r\n" + body;
}

namespace {

GatewayAnswer answer_of(const HttpReply& reply) {
    GatewayAnswer answer;
    if (reply.text.empty()) {
        answer.failure = reply.failure();
    } else if (!reply.is_http()) {
        answer.failure = "an answer that is no HTTP: " + first_line(reply.text);
    } else {
        const std::string status = reply.status();
        std::from_chars(status.data(), status.data() + status.size(), answer.status);
        answer.body = reply.body();
        boost::system::error_code wrong;
        boost::json::value value = boost::json::parse(answer.body, wrong);
        if (!wrong && value.is_object()) answer.json = std::move(value.as_object());
    }
    return answer;
}

GatewayAnswer no_answer(const char* why) {
    GatewayAnswer answer;
    answer.failure = why;
    return answer;
}

}  // namespace

GatewayAnswer GatewayClient::put_question(const std::string& request, Duration patience) const {
    return answer_of(
        ask(door_, request, patience, kMostOfAnswer, [](const HttpReply&) { return false; }));
}

GatewayAnswer GatewayClient::get(const std::string& path, Duration patience) const {
    return put_question(request("GET", path, ""), patience);
}

GatewayAnswer GatewayClient::put(const std::string& path, const std::string& body) const {
    return put_question(request("PUT", path, body), 30s);
}

std::optional<GatewayAnswer> GatewayClient::follow(
    const std::string& path, const std::function<bool()>& on_open,
    const std::function<bool(const Event&)>& on_event) const {
    EventCutter cutter;
    std::size_t taken = 0;  // bytes of the body
    bool opened = false;
    bool done = false;
    const auto look = [&](const HttpReply& reply) {
        const std::string_view body = reply.body();
        if (body.empty() || !(reply.status() + ' ').starts_with("200 ")) return false;
        if (!std::exchange(opened, true) && on_open()) return done = true;
        for (const Event& event : cutter.take(body.substr(taken)))
            if (on_event(event)) return done = true;
        taken = body.size();
        return false;
    };
    const HttpReply reply = ask(door_, request("GET", path, ""), kStream, kMostEvents, look);
    if (done) return std::nullopt;
    GatewayAnswer answer = answer_of(reply);
    if (answer.is_ok() && reply.error) return no_answer("the connection has ended");
    return answer;
}

std::string GatewayClient::reason(const GatewayAnswer& answer) const {
    if (answer.status == 0) return "no gateway answers at " + url() + ": " + answer.failure;
    const std::string detail = printable(text_of(answer.json, "detail"));
    if (answer.status == 401 && token_.empty())
        return url() + " wants a token: --token-file FILE, whose first line is one";
    if (answer.status == 401)
        return url() + " does not take the token in " + token_file_ +
               (detail.empty() ? "" : ": " + detail);
    return detail.empty() ? url() + " answers " + std::to_string(answer.status) : detail;
}

ExitCode GatewayClient::explain(const GatewayAnswer& answer, const std::string& what) const {
    std::cerr << "panelgate: " << what << reason(answer) << '\n';
    if (answer.status != 0) return kNotReady;
    std::cerr << "  (`panelgate run` and `panelgate demo` start one; where another listens: --http "
                 "HOST:PORT)\n";
    return kUnavailable;
}

bool ask_for(const GatewayClient& gateway, const std::string& path, boost::json::object& into,
             ExitCode& code) {
    GatewayAnswer answer = gateway.get(path);
    if (!answer.is_ok()) {
        code = gateway.explain(answer);
        return false;
    }
    into = std::move(answer.json);
    return true;
}

std::optional<std::vector<Station>> all_stations(const GatewayClient& gateway, ExitCode& code) {
    boost::json::object answer;
    if (!ask_for(gateway, "/api/v1/stations", answer, code)) return std::nullopt;
    std::vector<Station> all;
    for (const auto* one : objects_of(answer, "stations"))
        all.push_back({text_of(*one, "name"), text_of(*one, "line"),
                       static_cast<unsigned>(number_of(*one, "id").value_or(0))});
    return all;
}

std::optional<GatewayPlace> find_place(const GatewayClient& gateway, const Place& typed,
                                       ExitCode& code) {
    const auto all = all_stations(gateway, code);
    if (!all) return std::nullopt;
    const Named station = find_station(*all, typed.station);
    if (!station.wrong.empty()) {
        std::cerr << "panelgate: " << station.wrong << '\n';
        code = kNotReady;
        return std::nullopt;
    }
    GatewayPlace found;
    found.station = station.name;
    found.place = typed.place;
    const GatewayAnswer listed =
        gateway.get("/api/v1/stations/" + escaped(station.name) + "/points");
    for (const auto* point : objects_of(listed.json, "points")) {
        found.points.push_back(text_of(*point, "name"));
        if (found.points.back() == typed.place) found.type = text_of(*point, "type");
    }
    found.target = target_of(station.name, typed.place, found.points);
    return found;
}

bool may_have_type(const GatewayPlace& place, bool is_given) {
    if (place.target.kind != PlaceKind::point || !is_given) return true;
    std::cerr << "panelgate: " << place.target.shown
              << " is a point, which has its type and order in the configuration: leave out "
                 "--type, --order and --count\n";
    return false;
}

ExitCode explain_place(const GatewayClient& gateway, const GatewayPlace& place,
                       const GatewayAnswer& answer, const std::string& verb) {
    if (answer.status == 0 || answer.status == 401) return gateway.explain(answer);
    std::string why = verb == "read" ? gateway.reason(answer) : not_written_text(answer.json);
    if (answer.problem() == "unknown-notation") why = unknown_place(why, place.place, place.points);
    std::cerr << "panelgate: " << place.target.shown << " was not " << verb << ": " << why << '\n';
    return kNotReady;
}

}  // namespace panelgate::commands
