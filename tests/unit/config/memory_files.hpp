#pragma once

#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/config/config.hpp"

namespace panelgate::config {

/// Files in a map; directories are path prefixes.
class MemoryFiles final : public Files {
  public:
    explicit MemoryFiles(std::map<std::string, std::string> texts) : texts_(std::move(texts)) {}

    std::optional<std::string> read(const std::string& path) const override {
        const auto found = texts_.find(path);
        if (found == texts_.end()) return std::nullopt;
        return found->second;
    }
    std::optional<std::vector<std::string>> list_yaml(const std::string& dir) const override {
        std::vector<std::string> paths;
        for (const auto& [path, text] : texts_) {
            if (path.starts_with(dir + '/')) paths.push_back(path);
        }
        if (paths.empty()) return std::nullopt;
        return paths;
    }

    /// True below /public, and for one mounted secret.
    bool is_readable_by_all(const std::string& path) const override {
        return path.starts_with("/public/") || path == "/run/secrets/mounted";
    }
    bool is_special(const std::string& path) const override { return path == "/run/pipe"; }
    std::string real_path(const std::string& path) const override {
        const auto link = links.find(path);
        return link == links.end() ? path : link->second;
    }

    std::map<std::string, std::string> links;

  private:
    std::map<std::string, std::string> texts_;
};

/// Returns the valid configuration, or fails the test and throws.
inline Config load_valid(const std::string& text, const Files& files = MemoryFiles({}),
                         const std::string& name = "f.yaml") {
    yaml::Problems problems(name);
    std::optional<Config> config = load(text, files, problems);
    EXPECT_EQ(problems.text(), "") << text;
    return std::move(config).value();
}

}  // namespace panelgate::config
