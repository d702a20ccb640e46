#include "load_simulation.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <utility>

#include "panelgate/modbus/function.hpp"
#include "panelgate/yaml/map_reader.hpp"

namespace panelgate::profile {
namespace {

using yaml::MapReader;
using yaml::Node;
using yaml::Problems;
using Kind = Simulation::Motion::Kind;

constexpr std::array<std::pair<std::string_view, Kind>, 4> kKinds{
    {{"ramp", Kind::ramp}, {"sine", Kind::sine}, {"toggle", Kind::toggle}, {"clock", Kind::clock}}};

/// Area and address of a cell; a problem when the profile has no such item.
std::uint32_t place(MapReader& in, const PanelProfile& profile, std::string& area_name,
                    std::size_t items) {
    area_name = in.required_text("area").value_or("");
    const auto address =
        static_cast<std::uint32_t>(in.required_integer("address", 0, 65535).value_or(0));
    const Area* area = profile.find_area(std::string_view(area_name));
    if (area_name.empty()) return address;
    if (area == nullptr) {
        in.problem("area", "there is no area '" + area_name + '\'');
    } else if (items > 0 && !area->readable.contains(address, static_cast<std::uint32_t>(items))) {
        in.problem("address", "address lies outside the area " + area_name);
    }
    return address;
}

Simulation::Cell load_cell(const Node& node, const PanelProfile& profile, Problems& problems) {
    MapReader in(node, problems, "memory");
    Simulation::Cell cell;
    if (const Node* values = in.sequence("values")) {
        for (const Node& item : values->items) {
            const auto value = item.quoted ? std::nullopt : yaml::parse_integer(item.scalar);
            if (!value || *value < 0 || *value > 65535) {
                problems.add(item.mark, "values must list whole numbers from 0 to 65535");
            }
            cell.values.push_back(static_cast<std::uint16_t>(value.value_or(0)));
        }
    }
    if (node.kind == Node::Kind::map && in.child("values") == nullptr)
        in.problem("values", "memory needs 'values'");
    cell.address = place(in, profile, cell.area, cell.values.size());
    const Area* area = profile.find_area(std::string_view(cell.area));
    const bool bits = area != nullptr && modbus::is_bit_table(area->table);
    if (bits && std::any_of(cell.values.begin(), cell.values.end(), [](auto v) { return v > 1; }))
        in.problem("values", "the values of " + cell.area + " are bits: 0 or 1");
    in.finish();
    return cell;
}

Simulation::Motion load_motion(const Node& node, const PanelProfile& profile, Problems& problems) {
    MapReader in(node, problems, "motion");
    Simulation::Motion motion;
    motion.address = place(in, profile, motion.area, 1);
    motion.kind = in.choice<Kind>("kind", kKinds).value_or(Kind::ramp);
    motion.low = in.number("low").value_or(motion.low);
    motion.high = in.number("high").value_or(motion.high);
    if (motion.low < 0 || motion.high > 65535 || motion.low > motion.high) {
        in.problem("low", "low and high must be from 0 to 65535, low first");
    }
    motion.period = in.duration("period", 1s, 86400s).value_or(motion.period);
    in.finish();
    return motion;
}

}  // namespace

void load_simulation(const Node& node, PanelProfile& profile, Problems& problems) {
    MapReader in(node, problems, "simulation");
    Simulation& simulation = profile.simulation;
    simulation.protected_exception =
        static_cast<std::uint8_t>(in.integer("protected_exception", 1, 4).value_or(3));
    if (const Node* memory = in.sequence("memory")) {
        for (const Node& item : memory->items)
            simulation.memory.push_back(load_cell(item, profile, problems));
    }
    if (const Node* motion = in.sequence("motion")) {
        for (const Node& item : motion->items)
            simulation.motion.push_back(load_motion(item, profile, problems));
    }
    in.finish();
}

}  // namespace panelgate::profile
