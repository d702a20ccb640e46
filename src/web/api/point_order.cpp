#include "panelgate/web/api/point_order.hpp"

#include <utility>

#include "answer.hpp"
#include "reading.hpp"
#include "station_path.hpp"

namespace panelgate::web {

namespace json = boost::json;
namespace {

Parsed<PointOrder> plan(std::uint8_t station, const profile::PanelProfile& profile,
                        const points::Point& point, const points::Value& value) {
    auto write = points::write_request(profile, point, value);
    if (!write) return problem_of(write.error(), "");
    auto request = request_to(station, write->pdu);
    if (!request) return request.error();
    return PointOrder{std::move(*request), std::move(*write)};
}

}  // namespace

Problem problem_of(const points::WriteRefusal& refusal, const char* more) {
    if (refusal.malformed) return problem(400, refusal.message);
    return problem(422, refusal.message + (refusal.inexact ? more : ""), "outside-limits");
}

Parsed<PointOrder> order_of(const bus::RequestPort& bus, std::uint8_t station,
                            const profile::PanelProfile& profile, const points::Point& point,
                            const points::Value& value) {
    return unless_refused(plan(station, profile, point, value), bus, station);
}

json::object confirmed(const points::PointWrite& write) {
    json::object body{{"transmitted", true}, {"confirmed", true}};
    body["value"] = json_of(write.value);
    if (write.label) body["label"] = *write.label;
    return body;
}

Parsed<json::object> write_result(const PointOrder& order, const bus::Answer& answer,
                                  const profile::PanelProfile& profile) {
    if (auto failed = problem_of(answer, profile)) return std::move(*failed);
    return confirmed(order.write);
}

}  // namespace panelgate::web
