#include "panelgate/gateway/certificates.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include "panelgate/config/endpoint.hpp"
#include "panelgate/config/real_files.hpp"
#include "panelgate/gateway/prepare.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/tls/context.hpp"
#include "panelgate/tls/judge.hpp"

namespace panelgate::gateway {
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
    if (config.mqtt && config.mqtt->tls)
        all.push_back({"mqtt " + config.mqtt->broker(), config.mqtt->client(), config.mqtt->host});
    return all;
}

/// The names that are known: those of browsers, and an address of its own.
std::vector<std::string> names_of(const std::string& address, std::vector<std::string> hosts) {
    if (!config::is_any_address(address) && !config::is_loopback(address)) hosts.push_back(address);
    return hosts;
}

/// Reads all readable files into `files`; returns the first unreadable file, such as a file under
/// replacement, or "".
std::string read_again(const tls::Settings& settings, tls::Material& files) {
    std::string missing;
    const auto read = [&](const std::string& path, std::string& into) {
        if (path.empty()) return;
        if (auto text = config::RealFiles().read(path))
            into = std::move(*text);
        else if (missing.empty())
            missing = path;
    };
    read(settings.certificate, files.certificate);
    read(settings.key, files.key);
    read(settings.ca, files.ca);
    read(settings.crl, files.crl);
    return missing;
}

/// What comes into use of new files.
struct Taken {
    tls::Settings settings;
    std::string why{};  ///< the files are not all taken; "" if they are
};

/// `next` has the files to try.
Taken attempt(const ServedCertificate& used, tls::Settings next) {
    next.made = nullptr;
    try {
        if (used.server.empty())
            next.made = std::make_shared<const tls::Context>(next);
        else
            const tls::ClientContext usable(next, used.server);
    } catch (const tls::Unusable& why) {
        return {used.settings, why.what()};
    }
    return {std::move(next)};
}

/// A list of revoked certificates does not wait until a bad pair is mended.
Taken take(const ServedCertificate& used, const tls::Material& files) {
    tls::Settings next = used.settings;
    next.material = files;
    Taken whole = attempt(used, next);
    if (whole.why.empty()) return whole;
    next.material = used.settings.material;
    next.material.ca = files.ca;
    next.material.crl = files.crl;
    Taken some = attempt(used, next);
    return some.why.empty() ? Taken{std::move(some.settings), whole.why} : whole;
}

/// "certificate, key".
std::string changed_files(const tls::Material& before, const tls::Material& now) {
    using tls::Material;
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

/// A line each time: nobody should have to ask since when a certificate is in use.
void log_renewed(const std::string& listener, const tls::Material& before,
                 const tls::Material& now) {
    const tls::Summary own = tls::summary_of(now.certificate);
    std::vector<rt::LogField> fields{{"listener", listener}, {"files", changed_files(before, now)}};
    if (own.end != 0)
        fields.insert(fields.end(), {{"subject", own.subject},
                                     {"issuer", own.issuer},
                                     {"serial", own.serial},
                                     {"expires", tls::date_text(own.end)}});
    const std::size_t what = std::hash<std::string>()(now.certificate + now.key + now.ca + now.crl);
    rt::log_each("certificate renewed", listener, std::to_string(what), fields);
}

}  // namespace

void keep_certificates(config::Config& next, const std::vector<ServedCertificate>& in_use) {
    const auto keep = [&](const std::string& listener, tls::Settings& fresh) {
        const auto used = std::ranges::find(in_use, listener, &ServedCertificate::listener);
        if (used == in_use.end() || used->settings.material == fresh.material) return;
        tls::Settings stays = fresh;
        stays.material = used->settings.material;
        if (Taken taken = attempt(*used, std::move(stays)); taken.why.empty())
            fresh = std::move(taken.settings);
    };
    for_each_tls(next, keep);
    if (next.mqtt && next.mqtt->tls) {
        tls::Settings client = next.mqtt->client();
        keep("mqtt " + next.mqtt->broker(), client);
        next.mqtt->files = mqtt::Files{client.material};
    }
}

std::vector<std::string> certificate_doubts(const config::Config& config, std::int64_t now) {
    std::vector<std::string> all;
    const auto add = [&](const std::string& listener, const tls::Settings& tls,
                         const std::vector<std::string>& names) {
        for (const std::string& doubt : tls::doubts(tls, names, now))
            all.push_back(listener + ": " + doubt);
    };
    for (const config::Line& line : config.lines) {
        const auto device = line::parse_tcp_device(line.device.device);
        if (!line.device.tls || !device) continue;
        for (const std::string& doubt : tls::client_doubts(*line.device.tls, device->host, now))
            all.push_back("line " + line.name + ": " + doubt);
    }
    for (const tcp_server::Settings& listener : config.modbus_tcp)
        if (listener.tls)
            add("modbus_tcp " + listener.name(), *listener.tls, names_of(listener.address, {}));
    if (config.http && config.http->tls)
        add("http " + config.http->name(), *config.http->tls,
            names_of(config.http->address, config.http->hosts));
    if (config.mqtt && config.mqtt->tls)
        for (const std::string& doubt :
             tls::client_doubts(config.mqtt->client(), config.mqtt->host, now))
            all.push_back("mqtt: " + doubt);
    return all;
}

/// New files of one listener, judged.
struct CertificateWatch::Fresh {
    std::size_t at = 0;
    tls::Material files;  ///< as they were read
    Taken taken;
    std::vector<std::string> doubts{};  ///< that must not keep them back
};

/// One look. Owned by the loop, then by the worker, then by the loop again.
struct CertificateWatch::Look {
    std::uint64_t round = 0;
    std::int64_t now = 0;
    std::vector<Served> served;
    std::vector<std::optional<tls::Material>> seen;
    std::vector<std::string> missing;
    std::vector<Fresh> fresh;

    void read() {
        for (std::size_t i = 0; i < served.size(); ++i) {
            tls::Material files = served[i].settings.material;
            missing[i] = read_again(served[i].settings, files);
            if (files == served[i].settings.material) {
                seen[i].reset();
            } else if (std::exchange(seen[i], files) == files) {
                make(i, std::move(files));
            }
        }
    }
    void make(std::size_t at, tls::Material files) {
        const Served& used = served[at];
        Taken taken = take(used, files);
        std::vector<std::string> doubts =
            used.server.empty() ? tls::doubts(taken.settings, {}, now)
                                : tls::client_doubts(taken.settings, used.server, now);
        fresh.push_back({at, std::move(files), std::move(taken), std::move(doubts)});
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
        if (was == before.end() || was->settings.material == now.settings.material) continue;
        ++renewals_[now.listener].replaced;
        log_renewed(now.listener, was->settings.material, now.settings.material);
    }
    seen_.assign(served_.size(), std::nullopt);
    missing_.assign(served_.size(), "");
    told_missing_.assign(served_.size(), false);
    const auto is_gone = [&](const auto& one) {
        return std::ranges::find(served_, one.first, &Served::listener) == served_.end();
    };
    std::erase_if(refused_, is_gone);
    std::erase_if(renewals_, is_gone);
    ++round_;
    if (idle && !served_.empty()) later();
}

std::map<std::string, tls::Renewals> CertificateWatch::renewals() const {
    std::map<std::string, tls::Renewals> all;
    for (const Served& one : served_) {
        const auto count = renewals_.find(one.listener);
        all[one.listener.substr(one.listener.find(' ') + 1)] =
            count == renewals_.end() ? tls::Renewals{} : count->second;
    }
    return all;
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
        for (const Fresh& fresh : look.fresh) take_over(fresh);
    }
    later();
}

void CertificateWatch::take_over(const Fresh& fresh) {
    Served& served = served_[fresh.at];
    const tls::Settings& next = fresh.taken.settings;
    if (next.material != served.settings.material) {
        const tls::Material before = served.settings.material;
        served.settings = next;
        ++renewals_[served.listener].replaced;
        renew_(served);
        log_renewed(served.listener, before, next.material);
        for (const std::string& doubt : fresh.doubts)
            rt::log(rt::LogLevel::warn, "certificate",
                    {{"listener", served.listener}, {"warning", doubt}});
    }
    if (fresh.taken.why.empty() || refused_[served.listener] == fresh.files) return;
    refused_[served.listener] = fresh.files;
    ++renewals_[served.listener].kept;
    rt::log(rt::LogLevel::error, "certificate not renewed",
            {{"listener", served.listener}, {"reason", fresh.taken.why}});
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

}  // namespace panelgate::gateway
