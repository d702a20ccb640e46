#include "panelgate/tls/peer.hpp"

#include <gtest/gtest.h>
#include <openssl/x509v3.h>

#include <memory>
#include <string>
#include <vector>

#include "tls_rig.hpp"

namespace panelgate::tls::peer_test {
namespace {

struct FreeCertificate {
    void operator()(X509* certificate) const { X509_free(certificate); }
};
using Certificate = std::unique_ptr<X509, FreeCertificate>;

/// A certificate with these extensions for a role, each DER.
Certificate with_roles(const std::vector<std::string>& ders) {
    Certificate made(X509_new());
    for (const std::string& der : ders) {
        ASN1_OCTET_STRING* const value = ASN1_OCTET_STRING_new();
        ASN1_OCTET_STRING_set(value, reinterpret_cast<const unsigned char*>(der.data()),
                              static_cast<int>(der.size()));
        ASN1_OBJECT* const kind = OBJ_txt2obj(std::string(kRoleExtension).c_str(), 1);
        X509_EXTENSION* const extension = X509_EXTENSION_create_by_OBJ(nullptr, kind, 0, value);
        X509_add_ext(made.get(), extension, -1);
        X509_EXTENSION_free(extension);
        ASN1_OBJECT_free(kind);
        ASN1_OCTET_STRING_free(value);
    }
    return made;
}

constexpr const char* kUtf8 = "\x0c\x08operator";

TEST(Peer, NobodyWithoutACertificate) {
    const Peer peer = peer_of(nullptr);
    EXPECT_EQ(peer.subject, "");
    EXPECT_FALSE(peer.role);
}

// SEC-05: one UTF8String, the whole of it one role, once in a certificate.
TEST(Peer, ReadsTheRoleOfOneUtf8String) {
    const Peer peer = peer_of(with_roles({kUtf8}).get());
    EXPECT_EQ(peer.role, "operator");
    EXPECT_EQ(peer.role_fault, "");
}

TEST(Peer, NoExtensionIsNoRoleAndNoFault) {
    const Peer peer = peer_of(with_roles({}).get());
    EXPECT_FALSE(peer.role);
    EXPECT_EQ(peer.role_fault, "");
}

TEST(Peer, WhatIsNoSingleRoleDoesNotCount) {
    const std::string printable("\x13\x08operator", 10);
    const std::string trailing = std::string(kUtf8) + "x";
    const std::string empty("\x0c\x00", 2);
    const std::string control("\x0c\x02o\n", 4);
    const std::string cut("\x0c\x40oper", 6);
    const std::string constructed("\x2c\x0a\x0c\x08operator",
                                  12);  // BER, not DER, as the next ones
    const std::string indefinite("\x2c\x80\x0c\x08operator\x00\x00", 14);
    const std::string long_form("\x0c\x81\x08operator", 11);
    const std::string huge = std::string("\x0c\x81\xc8", 3) + std::string(200, 'x');
    for (const auto& ders : {std::vector{printable},
                             {trailing},
                             {empty},
                             {control},
                             {cut},
                             {constructed},
                             {indefinite},
                             {long_form},
                             {huge},
                             {std::string(kUtf8), std::string(kUtf8)},
                             {std::string()}}) {
        const Peer peer = peer_of(with_roles(ders).get());
        EXPECT_FALSE(peer.role) << ders.size();
        EXPECT_NE(peer.role_fault, "") << ders.size();
    }
}

TEST(Peer, RolesHaveTheNamesOfTheConfiguration) {
    EXPECT_EQ(role_named("operator"), Role::operator_);
    EXPECT_EQ(role_named("admin"), Role::admin);
    EXPECT_EQ(role_named("Operator"), Role::none);
    EXPECT_EQ(role_named("none"), Role::none);
}

}  // namespace
}  // namespace panelgate::tls::peer_test
