#include "panelgate/tls/replacement.hpp"

#include <openssl/bn.h>
#include <openssl/crypto.h>
#include <openssl/err.h>
#include <openssl/x509_vfy.h>
#include <openssl/x509v3.h>
#include <algorithm>
#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "native.hpp"
#include "panelgate/tls/judge.hpp"

namespace panelgate::tls {
namespace {

using Certificates = std::vector<Owned<X509>>;
using Lists = std::vector<Owned<X509_CRL>>;

struct FreeMore {
    void operator()(GENERAL_NAMES* names) const { GENERAL_NAMES_free(names); }
    void operator()(BIGNUM* number) const { BN_free(number); }
    void operator()(char* text) const { OPENSSL_free(text); }
};
template <class T>
using Kept = std::unique_ptr<T, FreeMore>;

bool is_valid(const X509* certificate, std::int64_t now) {
    return seconds_of(X509_get0_notBefore(certificate)) <= now &&
           now < seconds_of(X509_get0_notAfter(certificate));
}

/// True if one of these CAs has signed the first certificate, through those behind it.
bool verifies(const Certificates& trusted, const Certificates& chain, std::int64_t now) {
    if (trusted.empty() || chain.empty()) return false;
    const Owned<X509_STORE> store(X509_STORE_new());
    for (const auto& one : trusted) X509_STORE_add_cert(store.get(), one.get());
    const Owned<STACK_OF(X509)> between(sk_X509_new_null());
    for (const auto& one : chain) sk_X509_push(between.get(), one.get());
    const Owned<X509_STORE_CTX> judging(X509_STORE_CTX_new());
    X509_STORE_CTX_init(judging.get(), store.get(), chain.front().get(), between.get());
    X509_VERIFY_PARAM* const how = X509_STORE_CTX_get0_param(judging.get());
    X509_VERIFY_PARAM_set_time(how, static_cast<time_t>(now));
    X509_VERIFY_PARAM_set_flags(how, X509_V_FLAG_PARTIAL_CHAIN);
    const bool good = X509_verify_cert(judging.get()) == 1;
    ERR_clear_error();
    return good;
}

std::string text_of(const GENERAL_NAME* name) {
    int kind = 0;
    const void* const value = GENERAL_NAME_get0_value(name, &kind);
    if (kind != GEN_DNS && kind != GEN_IPADD) return "";
    const auto* const string = static_cast<const ASN1_STRING*>(value);
    const unsigned char* const bytes = ASN1_STRING_get0_data(string);
    const auto size = static_cast<std::size_t>(ASN1_STRING_length(string));
    if (kind == GEN_DNS) return {reinterpret_cast<const char*>(bytes), size};
    const Owned<BIO> out(BIO_new(BIO_s_mem()));
    GENERAL_NAME_print(out.get(), const_cast<GENERAL_NAME*>(name));
    char* text = nullptr;
    const long length = BIO_get_mem_data(out.get(), &text);
    const std::string shown(text, static_cast<std::size_t>(std::max(length, 0L)));
    return shown.substr(shown.find(':') + 1);  // "IP Address:10.0.0.7"
}

/// Host names and IP addresses.
std::vector<std::string> names_of(const X509* certificate) {
    std::vector<std::string> all;
    const Kept<GENERAL_NAMES> names(static_cast<GENERAL_NAMES*>(
        X509_get_ext_d2i(certificate, NID_subject_alt_name, nullptr, nullptr)));
    for (int i = 0; names && i < sk_GENERAL_NAME_num(names.get()); ++i)
        if (std::string text = text_of(sk_GENERAL_NAME_value(names.get(), i)); !text.empty())
            all.push_back(std::move(text));
    return all;
}

/// A name that clients know and the new certificate has no more; "" if it has all.
std::string lost_name(X509* used, X509* fresh) {
    const std::vector<std::string> has = names_of(fresh);
    for (const std::string& name : names_of(used)) {
        if (std::ranges::count(has, name) > 0) continue;
        const bool fits = X509_check_host(fresh, name.data(), name.size(), 0, nullptr) == 1;
        ERR_clear_error();
        if (!fits) return name;
    }
    return "";
}

bool have_key_in_common(const Certificates& some, const Certificates& others) {
    return std::ranges::any_of(some, [&](const auto& one) {
        return std::ranges::any_of(others, [&](const auto& other) {
            return EVP_PKEY_eq(X509_get0_pubkey(one.get()), X509_get0_pubkey(other.get())) == 1;
        });
    });
}

/// The CA that has signed it; null if it is not among these.
const X509* signer_of(const Certificates& authorities, X509_CRL* list) {
    const auto found = std::ranges::find_if(
        authorities, [&](const auto& one) { return has_signed(one.get(), list); });
    return found == authorities.end() ? nullptr : found->get();
}

bool is_overdue(const X509_CRL* list, std::int64_t now) {
    const ASN1_TIME* const next = X509_CRL_get0_nextUpdate(list);
    return next != nullptr && seconds_of(next) <= now;
}

class Comparison {
  public:
    Comparison(const Settings& used, const Settings& fresh, Arrival arrival, std::int64_t now)
        : used_(used), fresh_(fresh), noticed_(arrival == Arrival::noticed), now_(now) {}

    std::string judge() const {
        if (used_chain_.empty() || fresh_chain_.empty()) return "";
        for (const auto part :
             {&Comparison::judge_dates, &Comparison::judge_kind, &Comparison::judge_names,
              &Comparison::judge_ca_of_pair, &Comparison::judge_ca, &Comparison::judge_lists})
            if (std::string why = (this->*part)(); !why.empty()) return why;
        return "";
    }

    std::string judge_client() const {
        if (!used_chain_.empty() && !fresh_chain_.empty())
            if (std::string why = judge_dates(); !why.empty()) return why;
        const auto valid = [&](const auto& one) { return is_valid(one.get(), now_); };
        if (std::ranges::any_of(used_ca_, valid) && std::ranges::none_of(fresh_ca_, valid))
            return "the CA in " + fresh_.ca + " is not valid now: the server would be refused";
        return "";
    }

  private:
    X509* own() const { return fresh_chain_.front().get(); }
    bool is_used_one_good() const { return is_valid(used_chain_.front().get(), now_); }
    bool is_pair_new() const { return used_.material.certificate != fresh_.material.certificate; }
    std::string pair() const { return "the certificate in " + fresh_.certificate; }

    std::string judge_dates() const {
        if (!is_pair_new() || !is_used_one_good() || is_valid(own(), now_)) return "";
        const std::int64_t end = seconds_of(X509_get0_notAfter(own()));
        if (end <= now_) return pair() + " has expired on " + date_text(end);
        return pair() + " is valid from " + date_text(seconds_of(X509_get0_notBefore(own()))) +
               " only; compare the clock of the machine that made it";
    }
    /// Not all that is worse: what no client takes.
    std::string judge_kind() const {
        if (!is_pair_new() || !is_used_one_good()) return "";
        const auto serves = [](const auto& one) {
            return X509_check_purpose(one.get(), X509_PURPOSE_SSL_SERVER, 0) == 1;
        };
        if (serves(used_chain_.front()) && !serves(fresh_chain_.front()))
            return pair() + " is not one of a server (key usage): every client would refuse it";
        const auto valid = [&](const auto& one) { return is_valid(one.get(), now_); };
        if (!std::ranges::all_of(used_chain_, valid)) return "";
        const auto bad = std::ranges::find_if_not(fresh_chain_, valid);
        if (bad == fresh_chain_.end()) return "";
        return "the certificate " + subject_of(bad->get()) +
               ", which stands behind the gateway's in " + fresh_.certificate +
               ", is not valid now: every client would refuse the gateway's";
    }
    std::string judge_names() const {
        if (!noticed_ || !is_pair_new() || !is_used_one_good()) return "";
        const std::string lost = lost_name(used_chain_.front().get(), own());
        if (lost.empty()) return "";
        return pair() + " is not for " + lost + ", as the one in use is" + kAsk;
    }
    /// What clients trust is known where `ca` signs the gateway's certificate as well. Else the
    /// name at the top of the chain is compared: those between change with every renewal.
    std::string judge_ca_of_pair() const {
        if (!noticed_ || !is_pair_new() || !is_used_one_good()) return "";
        if (verifies(used_ca_, used_chain_, now_)) {
            if (verifies(used_ca_, fresh_chain_, now_)) return "";
        } else if (X509_NAME_cmp(X509_get_issuer_name(used_chain_.back().get()),
                                 X509_get_issuer_name(fresh_chain_.back().get())) == 0) {
            return "";
        }
        return pair() + " is of another CA than the one in use, which clients know" + kAsk;
    }
    std::string judge_ca() const {
        if (used_.material.ca == fresh_.material.ca || used_ca_.empty() || fresh_ca_.empty())
            return "";
        const auto valid = [&](const auto& one) { return is_valid(one.get(), now_); };
        const std::string what = "the CA in " + fresh_.ca;
        if (std::ranges::any_of(used_ca_, valid) && std::ranges::none_of(fresh_ca_, valid))
            return what + " is not valid now: every client would be refused";
        if (!noticed_) return "";
        const bool signed_own = verifies(used_ca_, used_chain_, now_);
        if (signed_own && !verifies(fresh_ca_, fresh_chain_, now_))
            return what + " has not signed the gateway's own certificate, as the one in use has" +
                   kAsk;
        if (!signed_own && !have_key_in_common(used_ca_, fresh_ca_))
            return what + " has nothing in common with the one in use" + kAsk;
        return "";
    }
    std::string judge_lists() const {
        if (used_.material.crl == fresh_.material.crl || fresh_.crl.empty()) return "";
        const Lists before = lists_of(used_.material.crl);
        const Lists now = lists_of(fresh_.material.crl);
        for (const auto& one : before) {
            const X509* const signer = signer_of(used_ca_, one.get());
            if (signer != nullptr && !is_still_served(signer)) continue;
            const auto next = std::ranges::find_if(now, [&](const auto& other) {
                return signer != nullptr ? has_signed(signer, other.get())
                                         : X509_NAME_cmp(X509_CRL_get_issuer(other.get()),
                                                         X509_CRL_get_issuer(one.get())) == 0;
            });
            if (std::string why = judge_list(*one, next == now.end() ? nullptr : next->get());
                !why.empty())
                return why;
        }
        return "";
    }
    /// Lists of a CA that is gone may go, too.
    bool is_still_served(const X509* authority) const {
        return std::ranges::any_of(fresh_ca_, [&](const auto& one) {
            return EVP_PKEY_eq(X509_get0_pubkey(one.get()), X509_get0_pubkey(authority)) == 1;
        });
    }
    std::string judge_list(const X509_CRL& before, X509_CRL* now) const {
        const std::string what = "the list of revoked certificates in " + fresh_.crl;
        if (now == nullptr) return what + " is not of the CA whose list is in use";
        const std::int64_t begin = seconds_of(X509_CRL_get0_lastUpdate(now));
        if (begin > now_)
            return what + " is valid from " + date_text(begin) +
                   " only, which is still to come: every client would be refused; compare the "
                   "clock of the machine that made it";
        if (is_overdue(now, now_) && !is_overdue(&before, now_))
            return what + " is overdue since " +
                   date_text(seconds_of(X509_CRL_get0_nextUpdate(now)));
        if (noticed_ && begin < seconds_of(X509_CRL_get0_lastUpdate(&before)))
            return what + " is older than the one in use" + kAsk;
        return "";
    }

    static constexpr const char* kAsk = "; if that is meant, `panelgate reload` takes it";

    const Settings& used_;
    const Settings& fresh_;
    bool noticed_;
    std::int64_t now_;
    Certificates used_chain_ = certificates_of(used_.material.certificate);
    Certificates fresh_chain_ = certificates_of(fresh_.material.certificate);
    Certificates used_ca_ = certificates_of(used_.material.ca);
    Certificates fresh_ca_ = certificates_of(fresh_.material.ca);
};

}  // namespace

std::string why_kept(const Settings& used, const Settings& fresh, Arrival arrival,
                     std::int64_t now) {
    return Comparison(used, fresh, arrival, now).judge();
}

std::string why_client_kept(const Settings& used, const Settings& fresh, std::int64_t now) {
    return Comparison(used, fresh, Arrival::noticed, now).judge_client();
}

Summary summary_of(std::string_view certificate) {
    const auto chain = certificates_of(certificate);
    if (chain.empty()) return {};
    const X509* const own = chain.front().get();
    Summary made;
    made.subject = subject_of(own);
    made.issuer = name_text(X509_get_issuer_name(own));
    const Kept<BIGNUM> number(ASN1_INTEGER_to_BN(X509_get0_serialNumber(own), nullptr));
    const Kept<char> serial(BN_bn2hex(number.get()));
    if (serial) made.serial = serial.get();
    made.begin = seconds_of(X509_get0_notBefore(own));
    made.end = seconds_of(X509_get0_notAfter(own));
    return made;
}

std::string changed_files(const Material& before, const Material& now) {
    constexpr std::array<std::pair<const char*, std::string Material::*>, 4> kFiles{
        {{"certificate", &Material::certificate},
         {"key", &Material::key},
         {"ca", &Material::ca},
         {"crl", &Material::crl}}};
    std::string text;
    for (const auto& [key, file] : kFiles)
        if (before.*file != now.*file) text += (text.empty() ? "" : ", ") + std::string(key);
    return text;
}

}  // namespace panelgate::tls
