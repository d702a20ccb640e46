#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/web/api/sources.hpp"

namespace panelgate::gateway {

/// The last texts of the configuration that ran, in memory, and as records for a store. One thread.
class TextVersions {
  public:
    static constexpr std::size_t kMost = 10;
    static constexpr std::string_view kPrefix = "configuration/";  ///< of the records' keys

    using Records = std::vector<std::pair<std::string, std::string>>;  ///< key, record
    /// Keeps a record under its key, in place of the record that was there.
    using Keep = std::function<void(const std::string& key, const std::string& record)>;

    /// No effect for the text that ran before.
    void add(const std::string& text, const std::string& who, WallTime now);
    /// The records of a former program come before the texts added so far; from now on `keep` gets
    /// each new one. Records that cannot be read are left out.
    void restore(const Records& kept, Keep keep);
    /// The newest first; none before restore(), because numbers are not known before.
    std::vector<web::TextVersion> list() const;
    std::optional<std::string> text(std::uint64_t version) const;

  private:
    struct Kept {
        web::TextVersion version;
        std::string text;
    };
    static std::optional<Kept> parse(const std::string& record);

    std::vector<Kept> kept_;  ///< the newest last
    Keep keep_;
    bool is_restored_ = false;
};

}  // namespace panelgate::gateway
