#include "setting_tree.hpp"

#include <cstddef>
#include <unordered_map>

#include "panelgate/config/describe.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::explain {
namespace {

using config::SettingMap;

/// The nodes of the maps that have been seen.
class Planting {
  public:
    explicit Planting(SettingTree& top) : top_(&top) {}

    SettingTree& node(const SettingMap& map) {
        if (map.above == nullptr) return *top_;
        // Several writers may have made the same map.
        const auto [found, is_new] = nodes_.try_emplace(map.path);
        if (is_new) {
            SettingTree& above = node(*map.above);
            above.below.push_back(std::make_unique<SettingTree>());
            above.below.back()->map = &map;
            nodes_[map.path] = above.below.back().get();
        }
        return *nodes_[map.path];
    }

  private:
    SettingTree* top_;
    std::unordered_map<std::string_view, SettingTree*> nodes_;
};

}  // namespace

std::string_view SettingTree::keys() const {
    return map == nullptr ? std::string_view() : map->keys;
}

std::string_view SettingTree::key() const { return keys().substr(keys().rfind('/') + 1); }

std::string_view SettingTree::name() const {
    const std::size_t above = map->above->path.empty() ? 0 : map->above->path.size() + 1;
    return std::string_view(map->path).substr(above + key().size() + 1);
}

SettingTree tree_of(const std::vector<config::Setting>& settings) {
    SettingTree top;
    Planting planting(top);
    const SettingMap* map = nullptr;
    SettingTree* node = nullptr;
    for (const config::Setting& setting : settings) {
        if (node == nullptr || map != setting.map.get()) node = &planting.node(*setting.map);
        map = setting.map.get();
        if (!setting.is_entry()) node->settings.push_back(&setting);
    }
    return top;
}

bool is_default(const config::Setting& setting,
                const std::function<const config::Setting*(std::string_view)>& find) {
    const config::Setting* owner = setting.otherwise.empty() ? nullptr : find(setting.otherwise);
    if (owner != nullptr) return owner->value == setting.value;
    if (setting.initial) return *setting.initial == setting.value;
    const config::KeyShape* key = config::describe().of(setting);
    return key != nullptr && !key->initial.empty() && key->initial == setting.value;
}

std::vector<std::string> list_items(const std::string& list) {
    yaml::Problems problems("");
    std::vector<std::string> items;
    for (const yaml::Node& item : yaml::parse(list, problems).items) {
        std::string keys;  // of a map, in a line
        for (const yaml::Entry& entry : item.entries)
            keys += (keys.empty() ? "" : ", ") + entry.key + ": " + entry.value.scalar;
        items.push_back(keys.empty() ? item.scalar : '{' + keys + '}');
    }
    return items;
}

}  // namespace panelgate::explain
