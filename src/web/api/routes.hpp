#pragma once

#include <boost/json/array.hpp>
#include <map>
#include <memory>
#include <vector>

#include "once.hpp"
#include "panelgate/web/api/directory.hpp"
#include "panelgate/web/api/server.hpp"
#include "panelgate/web/http/message.hpp"

namespace panelgate::web {

class KeptAnswer;

/// The handlers' data. The directory outlives every caller that has not left.
struct Api {
    const Directory* directory = nullptr;
    std::shared_ptr<const Directory> lent;   ///< the same, for the loop of the faces
    std::shared_ptr<const Directory> keeps;  ///< keeps the directory alive when it is replaced
    Providers providers;
    std::shared_ptr<KeyBook> keys;  ///< never null
    /// What is served now: for what outlives a reload. Never null.
    std::shared_ptr<const std::shared_ptr<const Directory>> current;
    /// The answers of get_configuration(), by the client's role and what it sees. Never null.
    std::shared_ptr<std::map<std::string, std::shared_ptr<KeptAnswer>>> configuration;
};
using Handler = Handling (*)(HttpRequest request, const Api* api);

Handling get_index(HttpRequest request, const Api* api);
Handling get_page(HttpRequest request, const Api* api);
Handling get_configuration(HttpRequest request, const Api* api);
Handling get_openapi(HttpRequest request, const Api* api);
Handling get_docs(HttpRequest request, const Api* api);
Handling get_manual(HttpRequest request, const Api* api);
Handling get_version(HttpRequest request, const Api* api);
Handling get_healthz(HttpRequest request, const Api* api);
Handling get_readyz(HttpRequest request, const Api* api);
Handling get_metrics(HttpRequest request, const Api* api);

Handling get_lines(HttpRequest request, const Api* api);
Handling get_line(HttpRequest request, const Api* api);
Handling get_trace(HttpRequest request, const Api* api);
Handling get_line_history(HttpRequest request, const Api* api);
Handling get_trace_pcapng(HttpRequest request, const Api* api);
Handling get_incidents(HttpRequest request, const Api* api);
Handling get_incident(HttpRequest request, const Api* api);
Handling post_broadcast(HttpRequest request, const Api* api);
Handling get_discovery(HttpRequest request, const Api* api);
Handling post_discover(HttpRequest request, const Api* api);
Handling delete_discovery(HttpRequest request, const Api* api);
Handling post_raw(HttpRequest request, const Api* api);

Handling post_read(HttpRequest request, const Api* api);
Handling post_write(HttpRequest request, const Api* api);

Handling get_stations(HttpRequest request, const Api* api);
Handling get_station(HttpRequest request, const Api* api);
Handling get_table(HttpRequest request, const Api* api);
Handling put_table(HttpRequest request, const Api* api);
Handling get_points(HttpRequest request, const Api* api);
Handling get_all_points(HttpRequest request, const Api* api);
Handling get_point(HttpRequest request, const Api* api);
Handling put_point(HttpRequest request, const Api* api);
Handling get_point_history(HttpRequest request, const Api* api);
/// The history of a point over days, as the store has it.
Handling get_days(HttpRequest request, const Api* api);
/// True if a request for a point's history asks the store: it names from, to or step.
bool asks_for_days(const HttpRequest& request);
Handling get_journal(HttpRequest request, const Api* api);
Handling get_standby(HttpRequest request, const Api* api);
Handling get_images(HttpRequest request, const Api* api);
Handling get_image(HttpRequest request, const Api* api);
Handling get_alarms(HttpRequest request, const Api* api);
Handling post_acknowledge(HttpRequest request, const Api* api);
Handling get_table_plan(HttpRequest request, const Api* api);
Handling get_device_plan(HttpRequest request, const Api* api);
Handling get_point_plan(HttpRequest request, const Api* api);
Handling get_interpretations(HttpRequest request, const Api* api);
Handling get_events(HttpRequest request, const Api* api);
Handling get_relays(HttpRequest request, const Api* api);
Handling get_findings(HttpRequest request, const Api* api);
Handling get_usage(HttpRequest request, const Api* api);

Handling get_reload(HttpRequest request, const Api* api);
Handling post_reload(HttpRequest request, const Api* api);

Handling get_configuration_text(HttpRequest request, const Api* api);
Handling put_configuration_text(HttpRequest request, const Api* api);
Handling post_configuration_check(HttpRequest request, const Api* api);
Handling post_configuration_insert(HttpRequest request, const Api* api);
Handling get_configuration_versions(HttpRequest request, const Api* api);
Handling get_configuration_version(HttpRequest request, const Api* api);
Handling get_configuration_schema(HttpRequest request, const Api* api);
Handling post_configuration_rollback(HttpRequest request, const Api* api);

Handling get_simulated(HttpRequest request, const Api* api);
Handling put_simulated(HttpRequest request, const Api* api);

Handling get_device(HttpRequest request, const Api* api);
Handling put_device(HttpRequest request, const Api* api);

/// Every path of the contract's section 5. The handlers share the API.
std::vector<Route> routes(std::shared_ptr<const Api> api);
/// Method, path and required role of each route, for the configuration's answer.
boost::json::array offered();
/// The routes that need no bus: probes, and the faults of simulated panels.
std::vector<Route> simulator_routes(std::shared_ptr<const Api> api);

}  // namespace panelgate::web
