#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/config/setting.hpp"

namespace panelgate::explain {

/// The settings of a map, and the maps and entries of lists below it, in the order of the tables.
struct SettingTree {
    const config::SettingMap* map = nullptr;
    std::vector<const config::Setting*> settings;
    std::vector<std::unique_ptr<SettingTree>> below;

    /// As SettingMap::keys; "" for the whole file.
    std::string_view keys() const;
    /// The key that it is the value of, or its list's.
    std::string_view key() const;
    /// Of an entry of a list, what it is known by.
    std::string_view name() const;
};

/// The settings of config::each_part(), which must outlive it, as in the file.
SettingTree tree_of(const std::vector<config::Setting>& settings);

/// True if leaving it out means its value. `find` gives the setting at a path; nullptr for none.
bool is_default(const config::Setting& setting,
                const std::function<const config::Setting*(std::string_view)>& find);

/// The items of a list's value, "[a, b]"; none of "".
std::vector<std::string> list_items(const std::string& list);

}  // namespace panelgate::explain
