#include "certificates.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "load.hpp"
#include "panelgate/config/endpoint.hpp"
#include "panelgate/config/real_files.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/tls/judge.hpp"
#include "panelgate/tls/replacement.hpp"

namespace panelgate::app {
namespace {

/// Calls `each` with the log's name of every listener that has `tls`, and with that.
template <class Config, class Each>
void for_each_tls(Config& config, const Each& each) {
    for (auto& listener : config.modbus_tcp)
        if (listener.tls) each("modbus_tcp " + listener.name(), *listener.tls);
    if (config.http && config.http->tls) each("http " + config.http->name(), *config.http->tls);
}

std::vector<ServedCertificate> served_by(const config::Config& config) {
    std::vector<ServedCertificate> all;
    for_each_tls(config, [&](const std::string& listener, const tls::Settings& settings) {
        all.push_back({listener, settings});
    });
    return all;
}

/// The names that are known: those of browsers, and an address of its own.
std::vector<std::string> names_of(const std::string& address, std::vector<std::string> hosts) {
    if (!config::is_any_address(address) && !config::is_loopback(address)) hosts.push_back(address);
    return hosts;
}

/// The file that cannot be read, such as while it is replaced; "" if all could.
std::string read_again(const tls::Settings& settings, tls::Material& files) {
    const auto read = [](const std::string& path, std::string& into) {
        if (path.empty()) return true;
        auto text = config::RealFiles::read_any(path);
        if (text) into = std::move(*text);
        return text.has_value();
    };
    if (!read(settings.certificate, files.certificate)) return settings.certificate;
    if (!read(settings.key, files.key)) return settings.key;
    if (!read(settings.ca, files.ca)) return settings.ca;
    return read(settings.crl, files.crl) ? "" : settings.crl;
}

/// A line each time: nobody should have to ask since when a certificate is in use.
void log_renewed(const std::string& listener, const tls::Material& before,
                 const tls::Material& now) {
    const tls::Summary own = tls::summary_of(now.certificate);
    const std::vector<rt::LogField> fields{{"listener", listener},
                                           {"files", tls::changed_files(before, now)},
                                           {"subject", own.subject},
                                           {"issuer", own.issuer},
                                           {"serial", own.serial},
                                           {"valid_from", tls::date_text(own.begin)},
                                           {"expires", tls::date_text(own.end)}};
    const std::size_t what = std::hash<std::string>()(now.certificate + now.key + now.ca + now.crl);
    rt::log_each("certificate renewed", listener, std::to_string(what), fields);
}

}  // namespace

std::vector<ServedCertificate> keep_good_certificates(config::Config& next,
                                                      const std::vector<ServedCertificate>& in_use,
                                                      std::int64_t now, bool rollback,
                                                      std::vector<std::string>& warnings) {
    std::vector<ServedCertificate> kept;
    for_each_tls(next, [&](const std::string& listener, tls::Settings& fresh) {
        const auto used = std::ranges::find(in_use, listener, &ServedCertificate::listener);
        if (used == in_use.end() || used->settings.material == fresh.material) return;
        const std::string why = tls::why_kept(used->settings, fresh, tls::Arrival::asked_for, now);
        if (why.empty() && !rollback) return;
        if (!why.empty()) {
            warnings.push_back(listener + ": certificate not renewed: " + why +
                               "; the former one stays in use");
            kept.push_back({listener, fresh});
        }
        tls::Settings stays = fresh;
        stays.material = used->settings.material;
        try {
            stays.made = std::make_shared<const tls::Context>(stays);
            fresh = std::move(stays);
        } catch (const tls::Unusable&) {  // other keys want what the former files do not have
            if (!why.empty()) kept.pop_back();
        }
    });
    return kept;
}

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
    std::int64_t now = 0;
    std::vector<Served> served;
    std::vector<std::optional<tls::Material>> seen;
    std::vector<std::string> missing;
    struct Fresh {
        std::size_t at = 0;
        tls::Settings settings;
        std::shared_ptr<const tls::Context> context;  ///< null: `why`
        std::string why;
        rt::LogLevel level = rt::LogLevel::error;
        std::vector<std::string> doubts{};  ///< that must not keep it back
    };
    std::vector<Fresh> fresh;

    void read() {
        for (std::size_t i = 0; i < served.size(); ++i) {
            tls::Material files;
            missing[i] = read_again(served[i].settings, files);
            if (!missing[i].empty()) continue;
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
            made.settings.made = std::make_shared<const tls::Context>(made.settings);
            made.why =
                tls::why_kept(served[at].settings, made.settings, tls::Arrival::noticed, now);
            made.level = rt::LogLevel::warn;
            if (made.why.empty()) made.context = made.settings.made;
            made.doubts = tls::doubts(made.settings, {}, now);
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
    const std::vector<Served> before = std::exchange(served_, served_by(config));
    for (const Served& now : served_) {
        const auto was = std::ranges::find(before, now.listener, &Served::listener);
        if (was != before.end() && was->settings.material != now.settings.material)
            log_renewed(now.listener, was->settings.material, now.settings.material);
    }
    seen_.assign(served_.size(), std::nullopt);
    missing_.assign(served_.size(), "");
    told_missing_.assign(served_.size(), false);
    std::erase_if(refused_, [&](const auto& one) {
        return std::ranges::find(served_, one.first, &Served::listener) == served_.end();
    });
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
    made->now = seconds_since_1970();
    made->served = served_;
    made->seen = seen_;
    made->missing.resize(served_.size());
    worker_.run([made] { made->read(); },
                [this, made, alive = std::weak_ptr(alive_)] {
                    if (!alive.expired()) judge(*made);
                });
}

void CertificateWatch::judge(Look& look) {
    if (look.round == round_) {
        seen_ = std::move(look.seen);
        for (std::size_t i = 0; i < served_.size(); ++i) tell_missing(i, look.missing[i]);
        for (Look::Fresh& fresh : look.fresh) {
            Served& served = served_[fresh.at];
            if (fresh.context) {
                const tls::Material before = served.settings.material;
                served.settings = fresh.settings;
                renew_(served, fresh.context);
                log_renewed(served.listener, before, served.settings.material);
                for (const std::string& doubt : fresh.doubts)
                    rt::log(rt::LogLevel::warn, "certificate",
                            {{"listener", served.listener}, {"warning", doubt}});
            } else if (std::exchange(refused_[served.listener], fresh.settings.material) !=
                       fresh.settings.material) {
                rt::log(fresh.level, "certificate not renewed",
                        {{"listener", served.listener}, {"reason", fresh.why}});
            }
        }
    }
    later();
}

/// A file that two looks miss is not just being replaced.
void CertificateWatch::tell_missing(std::size_t at, const std::string& file) {
    const bool stays_away = !file.empty() && missing_[at] == file;
    missing_[at] = file;
    if (file.empty()) told_missing_[at] = false;
    if (!stays_away || told_missing_[at]) return;
    told_missing_[at] = true;
    rt::log(rt::LogLevel::warn, "certificate file missing",
            {{"listener", served_[at].listener},
             {"file", file},
             {"reason",
              "it is gone or cannot be read; what it held stays in use, but a restart "
              "needs it"}});
}

}  // namespace panelgate::app
