#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/config/setting.hpp"

namespace panelgate::config {

/// Appends settings below a path to a list, which it does not own.
class SettingWriter {
  public:
    SettingWriter(std::vector<Setting>& settings, std::string path)
        : settings_(&settings), path_(std::move(path)) {}

    void put(std::string_view key, std::string value) const { add(key, std::move(value), ""); }
    /// Inherited from the same key of `owner` unless given itself.
    void put(std::string_view key, std::string value, const SettingWriter& owner) const {
        add(key, std::move(value), owner.at(key));
    }
    void put_secret(std::string_view key, std::string value) const {
        settings_->push_back({at(key), std::move(value), true, {}, true});
    }

    /// A writer for a map of keys; the map itself is no setting.
    SettingWriter below(std::string_view key) const { return {*settings_, at(key)}; }
    /// A writer for an entry that may exist or not, such as one of a list; adds the entry itself.
    SettingWriter item(std::string_view key) const {
        settings_->push_back({at(key), "", false, {}, true});
        return below(key);
    }
    SettingWriter item(std::string_view list, std::string_view name) const {
        return below(list).item(name);
    }

  private:
    std::string at(std::string_view key) const {
        return path_.empty() ? std::string(key) : path_ + '/' + std::string(key);
    }
    void add(std::string_view key, std::string value, std::string otherwise) const {
        settings_->push_back({at(key), std::move(value), false, std::move(otherwise), true});
    }

    std::vector<Setting>* settings_;
    std::string path_;
};

}  // namespace panelgate::config
