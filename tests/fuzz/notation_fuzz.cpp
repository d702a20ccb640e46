#include "panelgate/profile/notation.hpp"

#include <cstdlib>

#include "panelgate/profile/describe.hpp"
#include "panelgate/profile/load_profile.hpp"

using namespace panelgate::profile;

/// Any text is understood or explained, and what is understood survives being written again.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const Catalogue catalogue = Catalogue::shipped();
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    for (const auto& [name, profile] : catalogue.all()) {
        const auto item = parse_notation(profile, text);
        if (!item && item.error().message.empty()) std::abort();
        if (item) {
            const auto again = parse_notation(profile, format_notation(*item->area, item->address));
            if (!again || again->area != item->area || again->address != item->address)
                std::abort();
        }
        (void)describe_address(profile, text);
    }
    return 0;
}
