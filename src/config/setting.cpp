#include "panelgate/config/setting.hpp"

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "tables.hpp"

namespace panelgate::config {

std::string Distinct::name(const std::string& known_by) {
    const int count = ++seen_[known_by];
    return count == 1 ? known_by : known_by + " (" + std::to_string(count) + ')';
}

void each_part(const Config& config, const std::function<void(std::vector<Setting>)>& take) {
    const auto part = [&take](const auto& show) {
        std::vector<Setting> settings;
        show(SettingWriter(settings));
        take(std::move(settings));
    };
    part([&](const SettingWriter& top) { root_keys().show_values(top, config, nullptr); });
    for (const Line& line : config.lines)
        part([&](const SettingWriter& top) {
            line_keys().show(top.item("lines", line.name), line);
        });
    part([&](const SettingWriter& top) { root_keys().show_maps(top, config, nullptr, "lines"); });
}

std::vector<Setting> all_settings(const Config& config) {
    std::vector<Setting> all;
    each_part(config,
              [&](std::vector<Setting> part) { std::ranges::move(part, std::back_inserter(all)); });
    return all;
}

}  // namespace panelgate::config
