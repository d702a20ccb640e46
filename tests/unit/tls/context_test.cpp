#include "panelgate/tls/context.hpp"

#include <gtest/gtest.h>

#include <string>

#include "tls_rig.hpp"

namespace panelgate::tls::context_test {
namespace {

/// "KEY: TEXT" of what is wrong; "" if nothing is.
std::string fault_of(const Settings& settings) {
    try {
        const Context made(settings);
        return "";
    } catch (const Unusable& why) {
        return why.file + ": " + why.what();
    }
}

TEST(Context, SaysInOneSentenceWhatIsWrongWithAFile) {
    const TestPlant plant;
    Settings settings = plant.settings(ClientCertificate::required);
    EXPECT_EQ(fault_of(settings), "");
    settings.material.certificate = "no PEM";
    EXPECT_EQ(fault_of(settings),
              "certificate: gateway.crt holds no certificate; give a file in PEM form (-----BEGIN "
              "CERTIFICATE-----)");
    settings = plant.settings();
    settings.material.key = plant.server.certificate;
    EXPECT_EQ(fault_of(settings),
              "key: gateway.key holds no private key that can be read; give a file in PEM form "
              "(-----BEGIN PRIVATE KEY-----), without a password");
    settings.material.key = plant.ca.key;
    EXPECT_EQ(fault_of(settings),
              "key: the key in gateway.key does not belong to the certificate in gateway.crt; give "
              "the key that it was made with");
    settings = plant.settings();
    settings.material.ca = "";
    EXPECT_EQ(fault_of(settings),
              "ca: ca.crt holds no certificate; give the certificate of the CA that signs those of "
              "clients, in PEM form");
    settings = plant.settings();
    settings.crl = "crl.pem";
    settings.material.crl = plant.ca.certificate;
    EXPECT_EQ(fault_of(settings),
              "crl: crl.pem holds no list of revoked certificates; give a file in PEM form "
              "(-----BEGIN X509 CRL-----)");
}

TEST(Context, FilesThatAreCutOffMakeNone) {
    const TestPlant plant;
    const std::string both = plant.ca.certificate + issue_ca("Second", valid()).certificate;
    Settings settings = plant.settings();
    settings.material.ca = both;
    EXPECT_EQ(fault_of(settings), "");
    for (const std::size_t size : {both.size() - 5, both.size() - 200}) {
        settings.material.ca = both.substr(0, size);
        EXPECT_EQ(fault_of(settings).substr(0, 24), "ca: ca.crt is damaged or");
    }
}

TEST(Context, KnowsWhenItsCertificateEnds) {
    const TestPlant plant;
    const std::int64_t end = Context(plant.settings()).expiry();
    EXPECT_NEAR(static_cast<double>(end - std::time(nullptr)), 30 * 24 * 3600 - 3600, 60);
}

}  // namespace
}  // namespace panelgate::tls::context_test
