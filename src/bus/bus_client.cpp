#include "panelgate/bus/bus_client.hpp"

#include <atomic>
#include <functional>

namespace panelgate::bus {

ClientId next_client_id() {
    static std::atomic<ClientId> last{0};
    return ++last;
}

Host host_of(std::string_view address) {
    constexpr std::string_view kMapped = "::ffff:";  // how a listener on [::] sees IPv4
    if (address.starts_with(kMapped)) address.remove_prefix(kMapped.size());
    const auto hash = static_cast<Host>(std::hash<std::string_view>{}(address));
    return hash == 0 ? 1 : hash;
}

}  // namespace panelgate::bus
