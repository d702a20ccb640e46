#include "panelgate/tls/judge.hpp"

#include <openssl/bn.h>
#include <openssl/err.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>
#include <array>
#include <ctime>

#include "native.hpp"
#include "panelgate/tls/context.hpp"

namespace panelgate::tls {
namespace {

constexpr std::int64_t kSecondsADay = 24 * 3600;
using Said = std::vector<std::string>;

void judge_dates(const X509* certificate, const std::string& what, const char* effect,
                 std::int64_t now, Said& said) {
    const std::int64_t end = seconds_of(X509_get0_notAfter(certificate));
    const std::int64_t begin = seconds_of(X509_get0_notBefore(certificate));
    if (end <= now) {
        said.push_back(what + " has expired on " + date_text(end) + ": " + effect);
    } else if (begin > now) {
        said.push_back(what + " is valid from " + date_text(begin) +
                       " only; compare the clock of the machine that made it");
    } else if (end - now < kAnnouncedDays * kSecondsADay) {
        said.push_back(what + " expires on " + date_text(end) + ", in " +
                       std::to_string((end - now) / kSecondsADay) +
                       " days; put a new one in its place");
    }
}

bool is_for(X509* certificate, const std::string& name) {
    const int as_address = X509_check_ip_asc(certificate, name.c_str(), 0);
    const int fits = as_address != -2
                         ? as_address
                         : X509_check_host(certificate, name.data(), name.size(), 0, nullptr);
    ERR_clear_error();
    return fits == 1;
}

void judge_pair(const Settings& settings, const std::vector<std::string>& names, std::int64_t now,
                Said& said) {
    const auto chain = certificates_of(settings.material.certificate);
    if (chain.empty()) return;
    X509* const own = chain.front().get();
    const std::string what = "the certificate in " + settings.certificate;
    judge_dates(own, what, "clients refuse it", now, said);
    for (const auto& one : chain)
        if (one != chain.front())
            judge_dates(one.get(),
                        "the certificate " + subject_of(one.get()) + " in " + settings.certificate,
                        "clients refuse the gateway's", now, said);
    if ((X509_get_extended_key_usage(own) & XKU_SSL_SERVER) == 0)
        said.push_back(what + " is not one of a server (extended key usage): clients refuse it");
    for (const std::string& name : names)
        if (!is_for(own, name))
            said.push_back(
                what + " is not for " + name + ", by which clients reach it: they " +
                "refuse it; make one with all names (panelgate cert new-server NAME...)");
}

void judge_authorities(const Settings& settings, const char* effect, std::int64_t now, Said& said) {
    for (const auto& one : certificates_of(settings.material.ca)) {
        const std::string what = "the CA " + subject_of(one.get()) + " in " + settings.ca;
        judge_dates(one.get(), what, effect, now, said);
        if (X509_check_ca(one.get()) == 0)
            said.push_back(what + " is no CA: certificates that it has signed are refused");
    }
}

void judge_lists(const Settings& settings, std::int64_t now, Said& said) {
    const std::string what = "the list of revoked certificates in " + settings.crl;
    for (const auto& one : lists_of(settings.material.crl)) {
        const std::int64_t begin = seconds_of(X509_CRL_get0_lastUpdate(one.get()));
        const ASN1_TIME* const next = X509_CRL_get0_nextUpdate(one.get());
        if (begin > now)
            said.push_back(what + " is valid from " + date_text(begin) +
                           " only: every client is refused until then; compare the clock of the "
                           "machine that made it");
        else if (next != nullptr && seconds_of(next) <= now)
            said.push_back(what + " is overdue since " + date_text(seconds_of(next)) +
                           ": it still counts, but later revocations are not in it");
    }
}

}  // namespace

std::string date_text(std::int64_t seconds) {
    const auto time = static_cast<time_t>(seconds);
    std::tm parts{};
    ::gmtime_r(&time, &parts);
    std::array<char, 16> text{};
    return {text.data(), std::strftime(text.data(), text.size(), "%Y-%m-%d", &parts)};
}

Said doubts(const Settings& settings, const std::vector<std::string>& names, std::int64_t now) {
    Said said;
    judge_pair(settings, names, now, said);
    judge_authorities(settings, "the certificates that it has signed are refused", now, said);
    judge_lists(settings, now, said);
    return said;
}

Said client_doubts(const Settings& settings, const std::string& server, std::int64_t now) {
    Said said;
    try {
        const ClientContext usable(settings, server);
    } catch (const Unusable& why) {
        said.emplace_back(why.what());
    }
    for (const auto& one : certificates_of(settings.material.certificate))
        judge_dates(one.get(),
                    "the certificate " + subject_of(one.get()) + " in " + settings.certificate,
                    "the server refuses it", now, said);
    judge_authorities(settings, "the server's certificate is refused", now, said);
    return said;
}

Summary summary_of(std::string_view certificate) {
    const auto chain = certificates_of(certificate);
    if (chain.empty()) return {};
    const X509* const own = chain.front().get();
    const std::unique_ptr<BIGNUM, decltype(&BN_free)> number(
        ASN1_INTEGER_to_BN(X509_get0_serialNumber(own), nullptr), BN_free);
    char* const serial = BN_bn2hex(number.get());
    Summary made{subject_of(own), name_text(X509_get_issuer_name(own)), serial,
                 seconds_of(X509_get0_notAfter(own))};
    OPENSSL_free(serial);
    return made;
}

}  // namespace panelgate::tls
