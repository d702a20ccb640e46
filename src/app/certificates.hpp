#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/rt/process.hpp"
#include "panelgate/tls/context.hpp"
#include "panelgate/tls/settings.hpp"

namespace panelgate::app {

/// What is questionable in the certificates of a configuration, with the listener in front.
/// `now`: seconds since 1970.
std::vector<std::string> certificate_doubts(const config::Config& config, std::int64_t now);

/// Takes certificates, keys and lists of revoked ones into use as soon as their files have changed.
/// A worker reads them, and makes the context when two looks agree; the loop only swaps it. What no
/// context can be made of is logged once, and the former one stays. One thread; the clock outlives
/// it.
class CertificateWatch {
  public:
    static constexpr Duration kEvery = 1s;
    /// A listener and its settings; the name is as in the log: "http 127.0.0.1:8443".
    struct Served {
        std::string listener;
        tls::Settings settings;
    };
    using Renew = std::function<void(const Served&, std::shared_ptr<const tls::Context>)>;

    CertificateWatch(boost::asio::any_io_executor executor, rt::Clock& clock, Renew renew);

    /// Watches the files of this configuration from now on.
    void follow(const config::Config& config);
    void stop();

  private:
    struct Look;

    void later();
    void look();
    void judge(Look& look);

    rt::Clock& clock_;
    Renew renew_;
    std::unique_ptr<rt::Alarm> alarm_;
    std::vector<Served> served_;
    std::vector<std::optional<tls::Material>> seen_;  ///< by the last look, where it was another
    std::vector<tls::Material> refused_;              ///< already logged; by listener
    std::uint64_t round_ = 0;                         ///< of follow(): an older look does not count
    std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
    rt::Worker worker_;
};

}  // namespace panelgate::app
