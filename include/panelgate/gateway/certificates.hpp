#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/rt/process.hpp"
#include "panelgate/tls/counters.hpp"
#include "panelgate/tls/settings.hpp"

namespace panelgate::gateway {

/// What is questionable in the certificates of a configuration, with the listener in front.
/// `now`: seconds since 1970.
std::vector<std::string> certificate_doubts(const config::Config& config, std::int64_t now);

/// A listener and its `tls`; the name is as in the log: "http 127.0.0.1:8443". Or the gateway as
/// the client of a broker: "mqtt mqtts://broker:8883".
struct ServedCertificate {
    std::string listener;
    tls::Settings settings;
    std::string server{};  ///< the broker's name; "": it is a listener
};

/// Before a rollback, which reads no file: what is in use stays in use.
void keep_certificates(config::Config& next, const std::vector<ServedCertificate>& in_use);

/// Takes certificates, keys and lists of revoked certificates into use as soon as their files have
/// changed, if a context can be made of them. A worker reads the files, and makes the context when
/// two looks agree; the loop only swaps it. Files that no context can be made of are logged once,
/// as is a file that is gone; the former contents stay in use. One thread; the clock outlives it.
class CertificateWatch {
  public:
    static constexpr Duration kEvery = 1s;
    using Served = ServedCertificate;
    using Renew = std::function<void(const Served&)>;

    CertificateWatch(boost::asio::any_io_executor executor, rt::Clock& clock, Renew renew);

    /// Watches the files of this configuration from now on.
    void follow(const config::Config& config);
    /// What is in use.
    const std::vector<Served>& served() const { return served_; }
    /// Of what is served, by the address alone.
    std::map<std::string, tls::Renewals> renewals() const;
    void stop();

  private:
    struct Look;
    struct Fresh;

    void later();
    void look();
    void judge(Look& look);
    void take_over(const Fresh& fresh);
    void tell_missing(std::size_t at, const std::string& file);

    rt::Clock& clock_;
    Renew renew_;
    std::unique_ptr<rt::Alarm> alarm_;
    std::vector<Served> served_;
    std::vector<std::optional<tls::Material>> seen_;  ///< by the last look, where it was another
    std::vector<std::string> missing_;  ///< the file that the last look could not read, or ""
    std::vector<bool> told_missing_;
    std::map<std::string, tls::Material> refused_;  ///< already logged; by listener
    std::map<std::string, tls::Renewals> renewals_;
    std::uint64_t round_ = 0;  ///< of follow(): an older look does not count
    std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
    rt::Worker worker_;
};

}  // namespace panelgate::gateway
