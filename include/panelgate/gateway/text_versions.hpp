#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/web/api/sources.hpp"

namespace panelgate::gateway {

/// Keeps texts by their keys. One thread.
class TextKeeper {
  public:
    virtual ~TextKeeper() = default;
    /// Replaces the text of the same key.
    virtual void keep(const std::string& key, std::string text) = 0;
    virtual std::map<std::string, std::string> kept(const std::string& prefix) const = 0;
};

/// Until the program ends.
class MemoryKeeper final : public TextKeeper {
  public:
    void keep(const std::string& key, std::string text) override { kept_[key] = std::move(text); }
    std::map<std::string, std::string> kept(const std::string& prefix) const override;

  private:
    std::map<std::string, std::string> kept_;
};

/// The last texts of the configuration that ran. One thread.
class TextVersions {
  public:
    static constexpr std::size_t kMost = 10;

    /// Goes on where the keeper's end; the keeper outlives it.
    explicit TextVersions(TextKeeper& keeper);
    /// No effect for the text that ran before.
    void add(const std::string& text, const std::string& who, WallTime now);
    /// The newest first.
    std::vector<web::TextVersion> list() const;
    std::optional<std::string> text(std::uint64_t version) const;

  private:
    struct Kept {
        web::TextVersion version;
        std::string text;
    };
    std::vector<Kept> kept() const;

    TextKeeper& keeper_;
    web::TextVersion last_;
};

}  // namespace panelgate::gateway
