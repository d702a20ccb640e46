#include <boost/asio/error.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/value.hpp>
#include <csignal>
#include <iostream>
#include <sstream>
#include <string>
#include <thread>
#include <variant>

#include "answers.hpp"
#include "commands.hpp"
#include "gateway_client.hpp"
#include "http_door.hpp"
#include "local_gateway.hpp"
#include "output.hpp"
#include "panelgate/base/network.hpp"

namespace panelgate::commands {

namespace {

namespace json = boost::json;

constexpr Duration kPatience = 60s;  // a large file on a small machine
constexpr Duration kHealthTimeout = 2s;
// The pauses before a gateway is asked what came of its SIGHUP. Fewer than the wrong tokens that it
// answers at once.
constexpr Duration kPauses[] = {100ms, 500ms, 2s};
constexpr std::size_t kMostOfVerdict = 8 * 1024 * 1024;  // bytes of the verdict

/// Prints each text of a list on its own line.
void print_list(std::ostream& out, const json::object& verdict, std::string_view name,
                std::string_view before) {
    const json::value* list = verdict.if_contains(name);
    if (list == nullptr || !list->is_array()) return;
    for (const json::value& one : list->as_array())
        if (one.is_string()) out << before << std::string(one.as_string()) << '\n';
}

void print_faults(const json::object& verdict) {
    const json::value* list = verdict.if_contains("errors");
    if (list == nullptr || !list->is_array()) return;
    for (const json::value& one : list->as_array()) {
        const json::object* fault = one.if_object();
        if (fault == nullptr) continue;
        std::cerr << text_of(*fault, "file");
        if (fault->contains("line"))
            std::cerr << ':' << fault->at("line") << ':' << fault->at("column");
        std::cerr << ": " << text_of(*fault, "detail") << '\n';
    }
}

/// Prints the verdict of a gateway that understood the request.
ExitCode print_verdict(const json::object& verdict) {
    const std::string outcome = text_of(verdict, "outcome");
    if (outcome == "applied" || outcome == "unchanged") {
        std::ostringstream done;
        done << outcome << '\n';
        print_list(done, verdict, "changes", "  ");
        print_done(done.str());
        print_list(std::cerr, verdict, "weaker", "protects less: ");
        print_list(std::cerr, verdict, "warnings", "");
        print_list(std::cerr, verdict, "restart_needed", "only a restart changes: ");
        return kFine;
    }
    print_faults(verdict);
    std::cerr << "panelgate: not reloaded: " << text_of(verdict, "detail") << '\n';
    if (outcome == "refused") {
        print_list(std::cerr, verdict, "weaker", "  ");
        std::cerr << "  (where that is meant: panelgate reload --rollback --weaker)\n";
        return kNotReady;
    }
    return outcome == "invalid" ? kBadConfig : kUnavailable;
}

/// A gateway of this machine is asked by SIGHUP, which is for whoever may end it as well, where it
/// is asked by what its file says now and goes by what it said before: a token, a certificate, TLS
/// or none. The verdict is then asked for; it is known once the file has been read.
ExitCode reload_by_signal(const ReloadOptions& options, const HttpDoor& door,
                          const std::string& why, const std::string& remedy) {
    ExitCode code = kFine;
    const auto gateway =
        GatewayClient::make({options.file, options.http, options.token_file, options.ca}, code);
    if (!gateway) return code;
    const auto process = process_at(door.endpoint);
    if (options.rollback || !process || ::kill(*process, SIGHUP) != 0) {
        std::cerr << "panelgate: not reloaded: " << why << "\n  (" << remedy
                  << (options.rollback ? "reload first, then roll back"
                                       : "systemctl reload panelgate, or kill -HUP its process")
                  << ")\n";
        return kNotReady;
    }
    std::cerr << "panelgate: " << why << ": asked by SIGHUP, process " << *process << '\n';
    for (const Duration pause : kPauses) {
        std::this_thread::sleep_for(pause);
        const GatewayAnswer answer = gateway->get("/api/v1/reload");
        if (answer.is_ok() && answer.json.contains("outcome")) return print_verdict(answer.json);
    }
    std::cerr
        << "panelgate: the gateway got the signal, and cannot be asked for the result (a "
           "listener that wants a client's certificate answers no command): its log says "
           "whether it has reloaded; a token that systemd keeps (LoadCredential) is taken at "
           "a restart only, and a certificate that must not replace a good one is not taken\n";
    return kUnknown;
}

std::string reload_request(const ReloadOptions& options, const HttpDoor& door,
                           const std::string& secret) {
    return "POST /api/v1/reload" + std::string(options.rollback ? "?rollback=true" : "") +
           (options.weaker ? "&weaker=true" : "") +
           " HTTP/1.1\r\nHost: " + endpoint_text(door.endpoint.address, door.endpoint.port) +
           (secret.empty() ? "" : "\r\nAuthorization: Bearer ") + secret +
           "\r\nContent-Length: 0\r\nConnection: close\r\n\r\n";
}

/// True if somebody listens, who does not talk as the file says.
bool is_misunderstood(const HttpReply& reply) {
    namespace error = boost::asio::error;
    if (!reply.refused.empty()) return true;
    return reply.text.empty() &&
           (reply.error == error::eof || reply.error == error::connection_reset);
}

}  // namespace

ExitCode reload(const ReloadOptions& options) {
    const auto found = http_door({options.file, options.http, options.token_file, options.ca});
    if (const auto* none = std::get_if<NoHttpDoor>(&found)) {
        std::cerr << "panelgate: not reloaded: " << none->why << "; or kill -HUP its process\n";
        return none->code;
    }
    const auto& door = std::get<HttpDoor>(found);
    const auto secret = token_in(options.token_file);
    if (!secret) return kNoInput;
    const HttpReply reply = ask(door, reload_request(options, door, *secret), kPatience,
                                kMostOfVerdict, [](const HttpReply&) { return false; });
    if (!secret->empty() && reply.status().starts_with("401 "))
        return reload_by_signal(
            options, door,
            door.url() + " does not know the token in " + options.token_file + " yet",
            "if it has changed: ");
    if (is_misunderstood(reply))
        return reload_by_signal(options, door, door.url() + ": " + reply.failure(),
                                "if its certificate or `tls` has changed: ");
    boost::system::error_code wrong;
    const json::value body = json::parse(reply.body(), wrong);
    if (!wrong && body.is_object() && body.as_object().contains("outcome"))
        return print_verdict(body.as_object());
    std::string why = reply.text.empty() ? reply.failure() : reply.status();
    if (!wrong && body.is_object()) why += ": " + text_of(body.as_object(), "detail");
    std::cerr << "panelgate: not reloaded: " << door.url() << ": " << why << '\n';
    if (reply.text.empty() && options.http.empty())
        std::cerr << "  (if it runs with another `http: listen` than " << options.file
                  << " has now: --http HOST:PORT, or kill -HUP its process)\n";
    return kNotReady;
}

ExitCode health(const GatewayOptions& options, bool active) {
    const auto found = http_door(options);
    if (const auto* none = std::get_if<NoHttpDoor>(&found)) {
        std::cerr << "panelgate: " << (none->code == kUsage ? "" : "not ready: ") << none->why
                  << '\n';
        return none->code == kUsage ? kUsage : kNotReady;
    }
    const auto& door = std::get<HttpDoor>(found);
    const std::string why = ask_whether_ready(door, kHealthTimeout, active);
    if (why.empty()) return kFine;
    std::cerr << "panelgate: not ready: " << door.url() << "/readyz: " << why << '\n';
    return kNotReady;
}

}  // namespace panelgate::commands
