#include <cstdlib>

#include "panelgate/config/config.hpp"
#include "panelgate/mbusd/conf.hpp"

using namespace panelgate;

namespace {

struct NoFiles final : config::Files {
    std::optional<std::string> read(const std::string&) const override { return std::nullopt; }
    std::optional<std::vector<std::string>> list_yaml(const std::string&) const override {
        return std::nullopt;
    }
};

}  // namespace

/// Any text is a valid configuration afterwards, or has at least one problem, never both.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    yaml::Problems problems("mbusd.conf");
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    const auto imported = mbusd::import_conf(text, problems);
    if (imported.has_value() != problems.empty()) std::abort();
    if (!imported) return 0;
    yaml::Problems own("made.yaml");
    if (!config::load(imported->yaml, NoFiles(), own)) std::abort();
    return 0;
}
