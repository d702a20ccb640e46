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
    bool may_see = false;
    for (const AlarmView& alarm : seen_alarms(request, api))
        may_see = may_see || alarm.settings.name == name;
    if (!may_see) refuse(404, "there is no alarm '" + excerpt(name) + '\'');
    const auto done = api->providers.alarms->acknowledge(name, request.caller->name());
    if (done == AlarmSource::Acknowledged::nothing)
        refuse(409, "alarm '" + name + "' is normal, or somebody has acknowledged it already");
    log_client(*request.caller, "alarm acknowledged", {{"alarm", name}});
    for (const AlarmView& alarm : seen_alarms(request, api))
        if (alarm.settings.name == name)
            co_return json_response(200, alarms::describe(alarm.settings, alarm.status));
    refuse(404, "there is no alarm '" + excerpt(name) + '\'');
}

}  // namespace panelgate::web
