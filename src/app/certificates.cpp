#include "certificates.hpp"

#include <cstddef>
#include <utility>

#include "panelgate/config/endpoint.hpp"
#include "panelgate/config/real_files.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/tls/judge.hpp"

namespace panelgate::app {
namespace {

std::vector<CertificateWatch::Served> served_by(const config::Config& config) {
    std::vector<CertificateWatch::Served> all;
    for (const tcp_server::Settings& listener : config.modbus_tcp)
        if (listener.tls) all.push_back({"modbus_tcp " + listener.name(), *listener.tls});
    if (config.http && config.http->tls)
        all.push_back({"http " + config.http->name(), *config.http->tls});
    return all;
}

/// The names that are known: those of browsers, and an address of its own.
std::vector<std::string> names_of(const std::string& address, std::vector<std::string> hosts) {
    if (!config::is_any_address(address) && !config::is_loopback(address)) hosts.push_back(address);
    return hosts;
}

/// False if one of the files cannot be read, such as while it is replaced.
bool read_again(const tls::Settings& settings, tls::Material& files) {
    const auto read = [](const std::string& path, std::string& into) {
        if (path.empty()) return true;
        auto text = config::RealFiles::read_any(path);
        if (text) into = std::move(*text);
        return text.has_value();
    };
    return read(settings.certificate, files.certificate) && read(settings.key, files.key) &&
           read(settings.ca, files.ca) && read(settings.crl, files.crl);
}

}  // namespace

std::vector<std::string> certificate_doubts(const config::Config& config, std::int64_t now) {
    std::vector<std::string> all;
    const auto add = [&](const std::string& listener, const tls::Settings& tls,
                         const std::vector<std::string>& names) {
        for (const std::string& doubt : tls::doubts(tls, names, now))
            all.push_back(listener + ": " + doubt);
    };
    for (const tcp_server::Settings& listener : config.modbus_tcp)
        if (listener.tls)
            add("modbus_tcp " + listener.name(), *listener.tls, names_of(listener.address, {}));
    if (config.http && config.http->tls)
        add("http " + config.http->name(), *config.http->tls,
            names_of(config.http->address, config.http->hosts));
    return all;
}

/// One look. Owned by the loop, then by the worker, then by the loop again.
struct CertificateWatch::Look {
    std::uint64_t round = 0;
    std::vector<Served> served;
    std::vector<std::optional<tls::Material>> seen;
    struct Fresh {
        std::size_t at = 0;
        tls::Settings settings;
        std::shared_ptr<const tls::Context> context;  ///< null: `why`
        std::string why;
    };
    std::vector<Fresh> fresh;

    void read() {
        for (std::size_t i = 0; i < served.size(); ++i) {
            tls::Material files;
            if (!read_again(served[i].settings, files)) continue;
            if (files == served[i].settings.material) {
                seen[i].reset();
            } else if (std::exchange(seen[i], files) == files) {
                make(i, std::move(files));
            }
        }
    }
    void make(std::size_t at, tls::Material files) {
        Fresh made{at, served[at].settings, nullptr, ""};
        made.settings.material = std::move(files);
        made.settings.made = nullptr;
        try {
            made.context = std::make_shared<const tls::Context>(made.settings);
            made.settings.made = made.context;
        } catch (const tls::Unusable& why) {
            made.why = why.what();
        }
        fresh.push_back(std::move(made));
    }
};

CertificateWatch::CertificateWatch(boost::asio::any_io_executor executor, rt::Clock& clock,
                                   Renew renew)
    : clock_(clock),
      renew_(std::move(renew)),
      alarm_(clock.make_alarm()),
      worker_(std::move(executor)) {}

void CertificateWatch::follow(const config::Config& config) {
    const bool idle = served_.empty();
    served_ = served_by(config);
    seen_.assign(served_.size(), std::nullopt);
    refused_.assign(served_.size(), {});
    ++round_;
    if (idle && !served_.empty()) later();
}

void CertificateWatch::stop() { alarm_->cancel(); }

void CertificateWatch::later() {
    if (!served_.empty()) alarm_->arm(clock_.now() + kEvery, [this] { look(); });
}

void CertificateWatch::look() {
    const auto made = std::make_shared<Look>();
    made->round = round_;
    made->served = served_;
    made->seen = seen_;
    worker_.run([made] { made->read(); },
                [this, made, alive = std::weak_ptr(alive_)] {
                    if (!alive.expired()) judge(*made);
                });
}

void CertificateWatch::judge(Look& look) {
    if (look.round == round_) {
        seen_ = std::move(look.seen);
        for (Look::Fresh& fresh : look.fresh) {
            Served& served = served_[fresh.at];
            if (fresh.context) {
                served.settings = fresh.settings;
                renew_(served, fresh.context);
                rt::log(rt::LogLevel::info, "certificate renewed",
                        {{"listener", served.listener},
                         {"expires", tls::date_text(fresh.context->expiry())}});
            } else if (std::exchange(refused_[fresh.at], fresh.settings.material) !=
                       fresh.settings.material) {
                rt::log(rt::LogLevel::error, "certificate not renewed",
                        {{"listener", served.listener}, {"reason", fresh.why}});
            }
        }
    }
    later();
}

}  // namespace panelgate::app
