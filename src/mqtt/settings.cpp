#include "panelgate/mqtt/settings.hpp"

#include "panelgate/base/network.hpp"

namespace panelgate::mqtt {

std::string Settings::broker() const {
    return (tls ? "mqtts://" : "mqtt://") + endpoint_text(host, port);
}

tls::Settings Settings::client() const {
    tls::Settings made;
    made.ca = ca;
    made.certificate = certificate;
    made.key = key;
    made.material = files;
    return made;
}

}  // namespace panelgate::mqtt
