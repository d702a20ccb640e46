#include <cstdlib>

#include "panelgate/profile/describe.hpp"
#include "panelgate/profile/load_profile.hpp"

using namespace panelgate;

/// Any text gives a profile or at least one problem; a profile can be shown.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    yaml::Problems problems("fuzz.yaml");
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    const auto profile = profile::load_profile(text, "fuzz", problems);
    if (profile.has_value() != problems.empty()) std::abort();
    if (profile && profile::describe(*profile).empty()) std::abort();
    return 0;
}
