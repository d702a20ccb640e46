#include "prepare.hpp"

#include <memory>
#include <utility>

#include "address_families.hpp"
#include "capacity.hpp"
#include "connection_limits.hpp"
#include "inventory.hpp"
#include "panelgate/rt/descriptors.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::app {
namespace {

/// Before the first one is opened.
std::string fit_to_descriptors(config::Config& config) {
    const std::size_t limit = rt::raise_descriptor_limit();
    const std::string lowered = fit_connections(config, limit);
    if (lowered.empty()) return {};
    return "to " + lowered + ": this process may open " + std::to_string(limit) +
           " files (LimitNOFILE of the service, ulimit -Hn)";
}

}  // namespace

std::vector<Notice> prepare(config::Config& config) {
    separate_families(config);
    std::vector<Notice> notices;
    for (const std::string& warning : config.warnings)
        notices.push_back({"configuration", warning});
    for (const Capacity& line : capacities(config)) {
        for (const std::string& warning : line.warnings)
            notices.push_back({"planned requests", warning});
        if (plan::verdict(line.plan) != plan::Verdict::fine)
            notices.push_back({"planned load", overload_text(line)});
    }
    if (std::string lowered = fit_to_descriptors(config); !lowered.empty())
        notices.push_back({"max_connections lowered", std::move(lowered)});
    return notices;
}

web::SharedText shown_text(const config::Config& config) {
    return std::make_shared<const std::string>(web::json_text(inventory_json(config)));
}

}  // namespace panelgate::app
