#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/config/describe.hpp"
#include "panelgate/config/setting.hpp"

namespace panelgate::config {

/// Appends the settings of a map to a list, which it does not own.
class SettingWriter {
  public:
    explicit SettingWriter(std::vector<Setting>& settings)
        : settings_(&settings), map_(std::make_shared<const SettingMap>()) {}

    /// `owner`: the map whose key of the same name replaces a missing key, or null.
    void put(const KeyShape& key, std::string value, const SettingWriter* owner) const {
        Setting& made = add(key.path, std::move(value));
        made.initial = key.initial;
        if (owner != nullptr) made.otherwise = joined(owner->map_->path, key.path);
    }
    /// A key that is not one of the table's.
    void put(std::string_view key, std::string value) const { add(key, std::move(value)); }
    /// `lets_in`: the secret decides who is let in, so each change may protect the panels less.
    void put_secret(std::string_view key, std::string value, bool lets_in) const {
        Setting& made = add(key, std::move(value));
        made.secret = true;
        made.lets_in = lets_in;
    }

    std::size_t size() const { return settings_->size(); }
    std::span<Setting> since(std::size_t first) const {
        return std::span(*settings_).subspan(first);
    }

    /// A writer for a map of keys; the map itself is no setting.
    SettingWriter below(std::string_view key) const {
        return {*settings_, SettingMap{joined(map_->path, key), joined(map_->keys, key), map_}};
    }
    /// A writer for a map that may exist or not; adds the map itself.
    SettingWriter item(std::string_view key) const { return below(key).with_entry(); }
    /// The same for an entry of a list.
    SettingWriter item(std::string_view list, std::string_view name) const {
        const SettingWriter all = below(list);
        return SettingWriter(*settings_,
                             SettingMap{joined(all.map_->path, name), all.map_->keys, map_, true})
            .with_entry();
    }

  private:
    SettingWriter(std::vector<Setting>& settings, SettingMap map)
        : settings_(&settings), map_(std::make_shared<const SettingMap>(std::move(map))) {}

    static std::string joined(const std::string& path, std::string_view key) {
        std::string made;
        made.reserve(path.size() + 1 + key.size());
        if (!path.empty()) made.append(path).append(1, '/');
        return made.append(key);
    }
    SettingWriter with_entry() const {
        settings_->push_back({map_->path, "", false, {}, true, map_, {}});
        return *this;
    }
    Setting& add(std::string_view key, std::string value) const {
        return settings_->emplace_back(
            Setting{joined(map_->path, key), std::move(value), false, {}, true, map_, {}});
    }

    std::vector<Setting>* settings_;
    std::shared_ptr<const SettingMap> map_;
};

}  // namespace panelgate::config
