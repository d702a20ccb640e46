#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "answer.hpp"
#include "panelgate/alarms/webhook.hpp"
#include "panelgate/web/api/sources.hpp"
#include "routes.hpp"
#include "sight.hpp"

namespace panelgate::web {

namespace {

std::vector<AlarmView> seen_alarms(const HttpRequest& request, const Api* api) {
    std::vector<AlarmView> seen;
    if (api->providers.alarms == nullptr) return seen;
    const Sight sight(*api->directory, request.caller->who());
    for (AlarmView& alarm : api->providers.alarms->list()) {
        const bool may_see = alarm.line.empty() ? sight.everything()
                                                : sight.named(alarm.line, alarm.settings.station,
                                                              alarm.settings.point);
        if (may_see) seen.push_back(std::move(alarm));
    }
    return seen;
}

std::optional<AlarmView> find_seen(const HttpRequest& request, const Api* api) {
    for (AlarmView& alarm : seen_alarms(request, api))
        if (alarm.settings.name == request.arguments[0]) return std::move(alarm);
    return std::nullopt;
}

}  // namespace

Handling get_alarms(HttpRequest request, const Api* api) {
    std::vector<AlarmView> seen = seen_alarms(request, api);
    Table table{.name = "alarms", .count = seen.size()};
    table.entry = [seen = std::move(seen)](std::size_t i) {
        return alarms::describe(seen[i].settings, seen[i].status);
    };
    co_return table_answer(request, std::move(table));
}

Handling post_acknowledge(HttpRequest request, const Api* api) {
    const std::string name = request.arguments[0];
    if (!find_seen(request, api)) refuse(404, "there is no alarm '" + excerpt(name) + '\'');
    const auto done = api->providers.alarms->acknowledge(name, request.caller->name());
    if (done != AlarmSource::Acknowledged::done)
        refuse(409, "alarm '" + name + "' is normal, or somebody has acknowledged it already");
    log_client(*request.caller, "alarm acknowledged", {{"alarm", name}});
    const AlarmView now = find_seen(request, api).value();
    co_return json_response(200, alarms::describe(now.settings, now.status));
}

}  // namespace panelgate::web
