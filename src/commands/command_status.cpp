// status and top: what a running gateway tells of its lines and stations.
#include <sys/ioctl.h>
#include <unistd.h>
#include <cstdlib>
#include <iostream>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "commands.hpp"
#include "gateway_client.hpp"
#include "output.hpp"
#include "overview.hpp"
#include "panelgate/base/time.hpp"
#include "table.hpp"

namespace panelgate::commands {

namespace {

constexpr const char* kHome = "\x1b[H\x1b[2J";  // clears the screen

bool is_coloured() {
    return wants_colours(::isatty(STDOUT_FILENO) == 1, std::getenv("NO_COLOR"),
                         std::getenv("TERM"));
}

std::optional<Overview> look(const GatewayClient& gateway, ExitCode& code) {
    Overview overview;
    overview.url = gateway.url();
    boost::json::object lines;
    if (!ask_for(gateway, "/api/v1/lines", lines, code) ||
        !ask_for(gateway, "/api/v1/stations", overview.stations, code) ||
        !ask_for(gateway, "/api/v1/relays", overview.relays, code) ||
        !ask_for(gateway, "/api/v1/findings", overview.findings, code) ||
        !ask_for(gateway, "/api/v1/alarms", overview.alarms, code) ||
        !ask_for(gateway, "/api/v1/usage", overview.usage, code))
        return std::nullopt;
    for (const auto* line : objects_of(lines, "lines")) {
        boost::json::object all;
        if (!ask_for(gateway, "/api/v1/lines/" + escaped(text_of(*line, "name")), all, code))
            return std::nullopt;
        overview.lines.push_back(std::move(all));
    }
    const GatewayAnswer ready = gateway.get("/readyz");
    if (ready.status != 200) overview.not_ready = first_line(ready.body + ready.failure);
    return overview;
}

/// A screen that is drawn anew each second, also while the gateway is away.
std::string for_the_screen(const std::string& text) {
    constexpr winsize kUsual{.ws_row = 24, .ws_col = 80, .ws_xpixel = 0, .ws_ypixel = 0};
    winsize size{};
    if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_row < 2 || size.ws_col < 2)
        size = kUsual;
    return cut_to_screen(text, size.ws_row, size.ws_col);
}

[[noreturn]] void draw_for_ever(const GatewayClient& gateway, Overview overview) {
    std::string trouble;
    for (;;) {
        const std::string screen =
            top_text(overview, is_coloured()) + trouble + "\nCtrl-C ends it.";
        std::cout << kHome + for_the_screen(screen) << std::flush;
        if (!std::cout) end_without_output();
        std::this_thread::sleep_for(1s);
        trouble.clear();
        const GatewayAnswer there = gateway.get("/readyz");
        ExitCode code = kFine;
        auto next = there.status != 0 ? look(gateway, code) : std::nullopt;
        if (next)
            overview = std::move(*next);
        else
            trouble = '\n' + gateway.reason(there) + '\n';
    }
}

}  // namespace

ExitCode status(const GatewayOptions& at, bool json) {
    ExitCode code = kFine;
    const auto gateway = GatewayClient::make(at, code);
    if (!gateway) return code;
    const auto overview = look(*gateway, code);
    if (!overview) return code;
    std::cout << (json ? status_json(*overview) : status_text(*overview, is_coloured()));
    return troubles(*overview).empty() ? kFine : kNotReady;
}

ExitCode top(const GatewayOptions& at, bool once) {
    ExitCode code = kFine;
    const auto gateway = GatewayClient::make(at, code);
    if (!gateway) return code;
    auto overview = look(*gateway, code);
    if (!overview) return code;
    const char* const kind = std::getenv("TERM");
    const bool is_dumb = kind != nullptr && std::string_view(kind) == "dumb";
    if (once || is_dumb || ::isatty(STDOUT_FILENO) != 1) {
        std::cout << top_text(*overview, is_coloured());
        return kFine;
    }
    end_with_signals();
    draw_for_ever(*gateway, std::move(*overview));
}

}  // namespace panelgate::commands
