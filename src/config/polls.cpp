// Polls: their rows, and items in a panel's memory.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/points/settings.hpp"
#include "panelgate/profile/notation.hpp"
#include "tables.hpp"

namespace panelgate::config {

using points::Poll;
using yaml::Node;

bool read_place(Reader& in, std::string_view key, std::string& text, modbus::Table& table,
                std::uint16_t& address) {
    text = in.text(key).value_or("");
    const auto item = find_item(in, key, text, *in.loading.station->profile);
    if (!item) return false;
    table = item->area->table;
    address = item->address;
    return true;
}

const Keys<Poll>& poll_keys() {
    constexpr std::int64_t kLargest = 2040;  // the largest read of any panel: GT, ARCT1F501E 1.3.1
    static const auto kKeys =
        Keys<Poll>()
            .value(
                shape_of("read", Kind::text, "First register or bit, in the panel's notation."),
                [](Reader& in, Poll& poll) {
                    return read_place(in, "read", poll.read, poll.table, poll.address);
                },
                [](const Poll& poll) { return poll.read; })
            .required()
            .example("UW0")
            .integer("count", &Poll::count, 1, kLargest, "Number of registers or bits.")
            .example("32")
            .duration("every", &Poll::every, 1ms, points::kSlowest, "Interval between two reads.");
    return kKeys;
}

std::optional<Poll> load_poll(Reader& owner, const Node& node) {
    const profile::PanelProfile& profile = *owner.loading.station->profile;
    Reader in(owner.loading, node, "a poll", "{read: UW100, count: 8, every: 1s}");
    Poll poll;
    const bool known = poll_keys().read(in, poll).has("read");
    in.finish();
    if (!known) return std::nullopt;
    const profile::Area& area = *profile::parse_notation(profile, poll.read)->area;
    if (!area.readable.contains(poll.address, poll.count))
        in.problem("count",
                   std::to_string(poll.count) + " from " + poll.read + " reach beyond the end of " +
                       area.name + ", " +
                       format_notation(area, static_cast<std::uint16_t>(area.readable.last)));
    check_read_count(in, "count", profile, poll.table, poll.count);
    return poll;
}

std::optional<profile::Item> find_item(Reader& in, std::string_view key, const std::string& text,
                                       const profile::PanelProfile& profile) {
    if (text.empty()) return std::nullopt;
    const auto item = profile::parse_notation(profile, text);
    if (item) return *item;
    in.problem(key, item.error().message);
    return std::nullopt;
}

void check_read_count(Reader& in, std::string_view key, const profile::PanelProfile& profile,
                      modbus::Table table, std::uint32_t count) {
    const unsigned most = profile.max_count(modbus::read_function(table));
    if (count <= most) return;
    in.problem(key, profile.name + " gives at most " + std::to_string(most) +
                        (modbus::is_bit_table(table) ? " bits" : " registers") +
                        " in one read, not " + std::to_string(count));
}

const Keys<points::ReportRule>& report_keys() {
    using points::ReportRule;
    static const auto kKeys =
        Keys<ReportRule>()
            .number("deadband", &ReportRule::deadband, "Smallest change of a number that is told.")
            .example("0.5")
            .duration("at_most", &ReportRule::at_most, 1ms, 24h,
                      "Shortest time between two changes that are told.")
            .example("1s")
            .duration("at_least", &ReportRule::at_least, 100ms, 24h,
                      "An unchanged value is told again that often.")
            .example("60s");
    return kKeys;
}

void check_report(Reader& in, points::Point& point) {
    const points::ReportRule& rule = point.report;
    if (rule.deadband && *rule.deadband <= 0)
        in.problem("deadband", "deadband must be above 0, in the unit of the value");
    if (rule.at_most && rule.at_least && *rule.at_least < *rule.at_most)
        in.problem("at_least", "at_least " + yaml::format_duration(*rule.at_least) +
                                   " is below at_most, " + yaml::format_duration(*rule.at_most) +
                                   "; make it longer, or at_most shorter");
}

}  // namespace panelgate::config
