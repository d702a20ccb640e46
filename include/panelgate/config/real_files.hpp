#pragma once

#include "panelgate/config/config.hpp"

namespace panelgate::config {

/// Files of the real file system. After a failed read errno says why.
class RealFiles final : public Files {
  public:
    std::optional<std::string> read(const std::string& path) const override;
    std::optional<std::vector<std::string>> list_yaml(const std::string& dir) const override;
    bool is_readable_by_all(const std::string& path) const override;
};

}  // namespace panelgate::config
