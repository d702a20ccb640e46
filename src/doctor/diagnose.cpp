#include "panelgate/doctor/diagnose.hpp"

#include <tuple>
#include <utility>

#include "rules.hpp"

namespace panelgate::doctor {

std::vector<Finding> diagnose(const LineFacts& facts, const Sample& window,
                              const std::vector<Finding>& standing) {
    Case c{facts, window, window.total(), standing, {}};
    find_echo(c);
    find_no_answer(c);
    find_other_master(c);
    find_collision(c);
    find_overrun(c);
    for (const auto& [id, symptoms] : window.stations) find_crc_order(c, id, symptoms);
    for (const auto& [id, symptoms] : window.stations) find_lower_case(c, id, symptoms);
    find_all_damaged(c);
    find_trailing_bytes(c);
    for (const auto& [id, symptoms] : window.stations) {
        find_wrong_exception(c, id, symptoms);
        find_wrong_reply(c, id, symptoms);
        find_broadcast_replies(c, id, symptoms);
        find_duplicate_address(c, id, symptoms);
        find_short_timeout(c, id, symptoms);
        find_short_gap(c, id, symptoms);
        find_unasked_frames(c, id, symptoms);
        find_silent_station(c, id, symptoms);
    }
    if (facts.over_tcp) find_tcp_framing(c);
    find_noise(c);
    std::ranges::sort(c.findings, {},
                      [](const Finding& f) { return std::tuple(f.cause, f.station); });
    return std::move(c.findings);
}

}  // namespace panelgate::doctor
