// Two boxes on one line: the rows, and what cannot have a standby.

#include <algorithm>
#include <string>

#include "panelgate/alarms/settings.hpp"
#include "tables.hpp"

namespace panelgate::config {

namespace {

/// The file's first line is the token.
bool read_token(Reader& in, standby::Settings& settings) {
    const auto typed = in.text("token_file");
    if (!typed) return false;
    settings.token_file = in.loading.path_of(*typed);
    const auto text = in.loading.content_of(settings.token_file);
    if (!text) {
        in.problem("token_file", "cannot read " + settings.token_file +
                                     "; give the path of a file whose first line is a token");
        return false;
    }
    settings.token = text->substr(0, text->find_first_of("\r\n"));
    return true;
}

bool read_ca(Reader& in, standby::Settings& settings) {
    const auto typed = in.text("ca");
    if (!typed) return false;
    settings.ca = in.loading.path_of(*typed);
    const auto text = in.loading.content_of(settings.ca);
    if (!text)
        in.problem("ca", "cannot read " + settings.ca +
                             "; give the path of a PEM file that this program may read");
    settings.ca_pem = text.value_or("");
    return text.has_value();
}

}  // namespace

const Keys<standby::Settings>& standby_keys() {
    using standby::Settings;
    const auto fault = [](std::string_view typed) {
        return alarms::parse_url(typed)
                   ? std::string()
                   : "peer must be http://HOST:PORT or https://HOST:PORT, such as "
                     "https://box-b:8443, not " +
                         yaml::quote(typed);
    };
    static const auto kKeys =
        Keys<Settings>()
            .integer("rank", &Settings::rank, 0, 1,
                     "0 or 1, another one in each box: the box of rank 0 claims a silent line "
                     "first.")
            .required()
            .example("0")
            .text("peer", &Settings::peer, {"^https?://.", false, 0, fault},
                  "The other box's REST API. Without it the line alone decides.")
            .example("http://box-b:8080")
            .value(shape_of("token_file", Kind::text,
                            "File whose first line is a token that the other box knows; it needs "
                            "the right to read."),
                   read_token, [](const Settings& of) { return of.token_file; })
            .example("/run/secrets/peer")
            .value(shape_of("ca", Kind::text,
                            "PEM file of the CA that signed the other box's certificate."),
                   read_ca, [](const Settings& of) { return of.ca; })
            .example("/etc/panelgate/tls/ca.crt");
    return kKeys;
}

void check_standby(Reader& in, standby::Settings& settings) {
    const bool secure = settings.peer.starts_with("https://");
    if (secure && settings.ca.empty() && !in.has("ca"))
        in.problem("peer", "https needs ca: the file of the CA that signed the peer's certificate");
    const auto& lines = in.loading.config.lines;
    const bool any = std::ranges::any_of(
        lines, [](const Line& line) { return line.kind == Line::Kind::serial && !line.listens; });
    if (!any)
        in.warn("rank",
                "no line has a serial device that this box drives: a device server's only "
                "connection is the lock of a tcp:// line, and modbus-tcp:// needs none");
}

}  // namespace panelgate::config
