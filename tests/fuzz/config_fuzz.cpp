#include "panelgate/config/config.hpp"

#include <cstdlib>

using namespace panelgate;

namespace {

struct NoFiles final : config::Files {
    std::optional<std::string> read(const std::string&) const override { return std::nullopt; }
    std::optional<std::vector<std::string>> list_yaml(const std::string&) const override {
        return std::nullopt;
    }
};

}  // namespace

/// Any text gives a configuration or at least one problem, never both.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    yaml::Problems problems("fuzz.yaml");
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    const auto config =
        config::load(text, NoFiles(), problems, [](const std::string& name) { return name; });
    if (config.has_value() != problems.empty()) std::abort();
    if (config && config->lines.empty()) std::abort();
    return 0;
}
