// TLS of a device on Ethernet: the gateway is the client.

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/line/settings.hpp"
#include "panelgate/tls/context.hpp"
#include "tables.hpp"

namespace panelgate::config {

namespace {

using yaml::Node;

constexpr std::string_view kDeviceTls = "{ca: /etc/panelgate/tls/ca.crt}";

}  // namespace

const Keys<tls::Settings>& device_tls_keys() {
    using tls::Material;
    static const auto kKeys =
        Keys<tls::Settings>()
            .value(shape_of("ca", Kind::text,
                            "PEM file of the CA that signs the device's certificate. Without it "
                            "the system's trusted CAs."),
                   pem_file("ca", &tls::Settings::ca, &Material::ca),
                   [](const tls::Settings& of) { return of.ca; })
            .example("/etc/panelgate/tls/ca.crt")
            .value(shape_of("certificate", Kind::text,
                            "PEM file of the gateway's own certificate, with key; the role in it "
                            "decides what the device allows (Modbus/TCP Security)."),
                   pem_file("certificate", &tls::Settings::certificate, &Material::certificate),
                   [](const tls::Settings& of) { return of.certificate; })
            .example("/etc/panelgate/tls/box17.crt")
            .value(shape_of("key", Kind::text, "PEM file of that certificate's key."),
                   pem_file("key", &tls::Settings::key, &Material::key),
                   [](const tls::Settings& of) { return of.key; })
            .example("/etc/panelgate/tls/box17.key");
    return kKeys;
}

bool load_device_tls(Reader& in, Line& line) {
    const Node* const node = in.map("tls", kDeviceTls);
    if (node == nullptr) return false;
    Reader own(in.loading, *node, "tls", kDeviceTls);
    tls::Settings& settings = line.device.tls.emplace();
    const std::size_t before = own.problems().list().size();
    device_tls_keys().read(own, settings);
    if (settings.certificate.empty() != settings.key.empty())
        own.problem(settings.key.empty() ? "certificate" : "key",
                    "certificate and key belong together; give both");
    if (own.problems().list().size() == before) try {
            const auto endpoint = line::parse_tcp_device(line.device.device);
            const tls::ClientContext usable(settings, endpoint ? endpoint->host : "");
        } catch (const tls::Unusable& why) {
            own.problem(why.file, why.what());
        }
    own.finish();
    if (!line.device.modbus_tcp)
        in.problem("tls", "tls belongs to a device of modbus-tcp://; leave it out");
    return true;
}

void show_device_tls(const SettingWriter& out, const Line& line) {
    if (!line.device.tls) return;
    const SettingWriter section = out.item("tls");
    device_tls_keys().show(section, *line.device.tls);
    const tls::Material& files = line.device.tls->material;
    section.put_secret("files", files.ca + files.certificate + files.key, false);
}

}  // namespace panelgate::config
