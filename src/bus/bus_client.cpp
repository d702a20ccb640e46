#include "panelgate/bus/bus_client.hpp"

#include <atomic>

namespace panelgate::bus {

ClientId next_client_id() {
    static std::atomic<ClientId> last{0};
    return ++last;
}

}  // namespace panelgate::bus
