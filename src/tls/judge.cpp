#include "panelgate/tls/judge.hpp"

#include <openssl/err.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>
#include <algorithm>
#include <array>
#include <ctime>

#include "native.hpp"
#include "panelgate/tls/client_context.hpp"
#include "panelgate/tls/context.hpp"

namespace panelgate::tls {
namespace {

constexpr std::int64_t kSecondsADay = 24 * 3600;

class Judge {
  public:
    Judge(const Settings& settings, std::int64_t now) : settings_(settings), now_(now) {}

    void judge_dates(const X509* certificate, const std::string& what, const char* effect) {
        const std::int64_t end = seconds_of(X509_get0_notAfter(certificate));
        const std::int64_t begin = seconds_of(X509_get0_notBefore(certificate));
        if (end <= now_) {
            say(what + " has expired on " + date_text(end) + ": " + effect);
        } else if (begin > now_) {
            say(what + " is valid from " + date_text(begin) +
                " only; compare the clock of the machine that made it");
        } else if (end - now_ < kAnnouncedDays * kSecondsADay) {
            say(what + " expires on " + date_text(end) + ", in " +
                std::to_string((end - now_) / kSecondsADay) + " days; put a new one in its place");
        }
    }
    void judge_server(const std::vector<std::string>& names) {
        const auto chain = certificates_of(settings_.material.certificate);
        if (chain.empty()) return;
        X509* const own = chain.front().get();
        const std::string what = "the certificate in " + settings_.certificate;
        judge_dates(own, what, "clients refuse it");
        for (const auto& one : chain)
            if (one != chain.front())
                judge_dates(one.get(),
                            "the certificate " + subject_of(one.get()) +
                                ", which stands behind the gateway's in " + settings_.certificate,
                            "clients refuse the gateway's");
        if ((X509_get_extended_key_usage(own) & XKU_SSL_SERVER) == 0)
            say(what + " is not one of a server (extended key usage): clients refuse it");
        judge_names(own, what, names);
        judge_chain(chain, what);
    }
    void judge_clients() {
        const auto authorities = certificates_of(settings_.material.ca);
        for (const auto& one : authorities) {
            const std::string what = "the CA " + subject_of(one.get()) + " in " + settings_.ca;
            judge_dates(one.get(), what, "the certificates that it has signed are refused");
            if (X509_check_ca(one.get()) == 0)
                say(what + " is no CA: certificates that it has signed are refused");
        }
        const auto lists = lists_of(settings_.material.crl);
        if (!lists.empty())
            for (const X509* const one : without_list(authorities, lists))
                say("the CA " + subject_of(one) + " in " + settings_.ca + " has no list in " +
                    settings_.crl +
                    ": the certificates that it has signed are refused; `panelgate cert revoke` "
                    "without a file makes a list, and crl takes those of several CAs, one behind "
                    "the other");
        for (const auto& one : lists) {
            const std::int64_t begin = seconds_of(X509_CRL_get0_lastUpdate(one.get()));
            if (begin > now_)
                say("the list of revoked certificates in " + settings_.crl + " is valid from " +
                    date_text(begin) +
                    " only, which is still to come: every client is refused until then; compare "
                    "the "
                    "clock of the machine that made it");
            const ASN1_TIME* const next = X509_CRL_get0_nextUpdate(one.get());
            if (next == nullptr || seconds_of(next) > now_) continue;
            say("the list of revoked certificates in " + settings_.crl + " is overdue since " +
                date_text(seconds_of(next)) +
                ": it still counts, but later revocations are not in it");
        }
    }
    void judge_client(const std::string& server) {
        try {
            const ClientContext usable(settings_, server);
        } catch (const Unusable& why) {
            say(why.what());
        }
        for (const auto& one : certificates_of(settings_.material.certificate))
            judge_dates(one.get(),
                        "the certificate " + subject_of(one.get()) + " in " + settings_.certificate,
                        "the server refuses it");
        for (const auto& one : certificates_of(settings_.material.ca))
            judge_dates(one.get(), "the CA " + subject_of(one.get()) + " in " + settings_.ca,
                        "the server's certificate is refused");
    }
    std::vector<std::string> take() { return std::move(said_); }

  private:
    void judge_names(X509* own, const std::string& what, const std::vector<std::string>& names) {
        for (const std::string& name : names) {
            const bool is_address = X509_check_ip_asc(own, name.c_str(), 0) != -2;
            const int fits = is_address
                                 ? X509_check_ip_asc(own, name.c_str(), 0)
                                 : X509_check_host(own, name.data(), name.size(), 0, nullptr);
            ERR_clear_error();
            if (fits != 1)
                say(what + " is not for " + name + ", by which clients reach it: they refuse it; " +
                    "make one with all names (panelgate cert new-server NAME...)");
        }
    }
    /// A certificate that another one signed needs it, or the clients must have it.
    void judge_chain(const std::vector<Owned<X509>>& chain, const std::string& what) {
        for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
            if (X509_check_issued(chain[i + 1].get(), chain[i].get()) == X509_V_OK) continue;
            say(what + ": the certificates behind it are not those that signed it, in order");
            return;
        }
    }
    void say(std::string text) { said_.push_back(std::move(text)); }

    const Settings& settings_;
    std::int64_t now_;
    std::vector<std::string> said_;
};

}  // namespace

std::string date_text(std::int64_t seconds) {
    const auto time = static_cast<time_t>(seconds);
    std::tm parts{};
    ::gmtime_r(&time, &parts);
    std::array<char, 16> text{};
    return {text.data(), std::strftime(text.data(), text.size(), "%Y-%m-%d", &parts)};
}

std::vector<std::string> client_doubts(const Settings& settings, const std::string& server,
                                       std::int64_t now) {
    Judge judge(settings, now);
    judge.judge_client(server);
    return judge.take();
}

std::vector<std::string> doubts(const Settings& settings, const std::vector<std::string>& names,
                                std::int64_t now) {
    Judge judge(settings, now);
    judge.judge_server(names);
    judge.judge_clients();
    return judge.take();
}

}  // namespace panelgate::tls
