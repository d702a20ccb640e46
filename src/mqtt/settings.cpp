#include "panelgate/mqtt/settings.hpp"

#include "panelgate/base/network.hpp"

namespace panelgate::mqtt {

std::string Settings::broker() const {
    return (tls ? "mqtts://" : "mqtt://") + endpoint_text(host, port);
}

}  // namespace panelgate::mqtt
