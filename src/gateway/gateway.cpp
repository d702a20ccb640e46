#include "panelgate/gateway/gateway.hpp"

#include <algorithm>
#include <array>
#include <boost/asio/post.hpp>
#include <charconv>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <variant>

#include "panelgate/bus/bus_client.hpp"
#include "panelgate/explain/load.hpp"
#include "panelgate/gateway/build_info.hpp"
#include "panelgate/gateway/plant.hpp"
#include "panelgate/gateway/prepare.hpp"
#include "panelgate/gateway/reloader.hpp"
#include "panelgate/gateway/running_line.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/rt/loop.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::gateway {

/// The text for `systemctl status`: "2 of 3 lines up, listening on modbus_tcp 127.0.0.1:502, http
/// 127.0.0.1:8080". `listening` and `missing` are those of Openings.
std::string service_status(const Plant& plant, const std::string& listening,
                           const std::string& missing);

std::string service_status(const Plant& plant, const std::string& listening,
                           const std::string& missing) {
    const auto& lines = plant.lines();
    const auto up =
        std::ranges::count_if(lines, [](const Line& line) { return line.bus->status().up; });
    std::string text = std::to_string(up) + " of " + std::to_string(lines.size()) +
                       (lines.size() == 1 ? " line up" : " lines up");
    if (!listening.empty()) text += ", listening on " + listening;
    if (!missing.empty()) text += ", waiting to listen on " + missing;
    return text;
}

namespace {

/// A random prefix of event ids, new in each run of the program.
std::string new_epoch() {
    constexpr int kHex = 16;
    std::array<char, 8> text{};
    const auto [end, wrong] =
        std::to_chars(text.data(), text.data() + text.size(), std::random_device()(), kHex);
    return std::string(text.data(), end);
}

/// Returns the line of the new configuration that continues `line`; null for a removed line.
const config::Line* find_same(const config::Config& config, const config::Line& line,
                              bool simulate) {
    const auto found = std::ranges::find_if(config.lines, [&](const config::Line& one) {
        return one.name == line.name && way_of(one, simulate) == way_of(line, simulate);
    });
    return found == config.lines.end() ? nullptr : &*found;
}

std::vector<points::RelayRoute> routes_of(const Snapshot& snapshot) {
    std::vector<points::RelayRoute> routes;
    for (const points::Relay& relay : snapshot.config->relays)
        routes.push_back(route_of(snapshot.plant, relay));
    return routes;
}

std::vector<web::Token> tokens_of(const config::Config& config) {
    return config.http ? config.http->tokens : std::vector<web::Token>{};
}

std::shared_ptr<const Plant> plant_in(const std::shared_ptr<Snapshot>& snapshot) {
    return {snapshot, &snapshot->plant};
}

std::shared_ptr<const web::Directory> directory_in(const std::shared_ptr<Snapshot>& snapshot) {
    return {snapshot, &snapshot->directory};
}

}  // namespace

Gateway::Gateway(web::Loops loops, std::shared_ptr<const config::Config> config, bool simulate,
                 Reloader* reloads, web::TextSource* text)
    : loops_(std::move(loops)),
      clock_(loops_.plant),
      simulate_(simulate),
      reloads_(reloads),
      text_(text),
      events_(std::make_shared<web::EventHub>(new_epoch()), loops_.faces),
      servers_(loops_, clock_, audit_.stray_writes()),
      northbound_(loops_, clock_, journal_, audit_.topic_refusals()) {
    configured_ = config;
    standby_.apply(*config);
    config = standby_.arrange(config);
    Lines lines = lines_of(*config);
    for (std::size_t i = 0; i < lines.size(); ++i)
        known_.lines.emplace(std::pair(config->lines[i].name, lines[i]->way()), lines[i]);
    doors_.open(config);
    show(make_snapshot(std::move(config), std::move(lines), images_));
    relays_ = std::make_unique<points::Relays>(clock_, routes_of(*snapshot_));
    relay_listener_ = relays_->write_listener();
    relays_->on_state([](const points::RelayStatus& relay) {
        const bool ok = relay.state == points::RelayState::ok;
        rt::log_about(relay.name, ok ? rt::LogLevel::info : rt::LogLevel::warn, "relay",
                      {{"relay", relay.name}, {"state", text_of(relay)}});
    });
}

/// What the faces hold of the plant comes back while the plant is still there.
Gateway::~Gateway() {
    servers_.close();
    rt::call(loops_.faces, loops_.plant, [] {});  // events on their way, which own the hub
}

Gateway::KnownLines::~KnownLines() {
    for (const auto& [name, line] : lines) line->dispose();
}

LineWatch Gateway::watch(std::size_t lines) {
    LineWatch watch;
    watch.trace = bus::TraceSettings::of(lines);
    watch.event = [this](const std::string& line, const bus::BusEvent& event) {
        on_event(line, event);
    };
    watch.points = [this](const std::string& line, std::uint8_t station,
                          const std::vector<std::size_t>& wants) {
        on_points(line, station, wants);
    };
    watch.write = [this](const std::string& line, const bus::WriteEnd& end) {
        audit_.write(line, end);
    };
    watch.may_send = [this](const std::string& line) { return standby_.may_send(line); };
    watch.refuses_writes = [this] { return audit_.refuses_writes(); };
    watch.admit = [this](const WhoRef& who, const std::string& line, std::uint8_t station) {
        return doors_.admit(who, line, station, rt::wall_now());
    };
    return watch;
}

void Gateway::on_event(const std::string& line, const bus::BusEvent& event) {
    publish(events_, snapshot_->plant, line, event);
    journal_.on_event(line, event);
    standby_.on_event(line, event);
    northbound_.on_bus_event(line, event);
    const auto* write = std::get_if<bus::WriteEvent>(&event);
    if (write != nullptr && relay_listener_) relay_listener_(line, *write);
}

void Gateway::on_points(const std::string& line, std::uint8_t id,
                        const std::vector<std::size_t>& wants) {
    if (snapshot_->plant.find(line, id) == nullptr)
        return;  // the new snapshot is about to replace this one
    Station& station = snapshot_->plant.at(line, id);
    remember(station, wants, clock_.now());
    journal_.on_points(station, wants);
    alarms_.on_points(station, wants);
    publish_points(events_, station, wants, clock_.now());
    northbound_.on_points(station, wants);
}

void Gateway::on_alarm(const alarms::Change& change) {
    hook_.on_change(change);
    const alarms::Settings& alarm = *change.alarm;
    rt::log(change.kind == alarms::Change::Kind::raised ? rt::LogLevel::warn : rt::LogLevel::info,
            "alarm",
            {{"alarm", alarm.name},
             {"state", std::string(alarms::label(change.now.state))},
             {"severity", alarm.severity}});
    if (events_.is_wanted())
        events_.publish({"alarm", alarms_.line_of(alarm), alarm.station, alarm.point},
                        web::json_text(alarms::describe(alarm, change.now)));
}

/// Existing lines where possible, and new ones.
Gateway::Lines Gateway::lines_of(const config::Config& config) {
    Lines lines;
    for (const config::Line& line : config.lines) {
        const auto found = known_.lines.find({line.name, way_of(line, simulate_)});
        lines.push_back(found != known_.lines.end()
                            ? found->second
                            : std::make_shared<RunningLine>(loops_.plant, clock_, line, simulate_,
                                                            watch(config.lines.size())));
    }
    return lines;
}

void Gateway::apply_lines(const config::Config& config, const Lines& lines) {
    for (std::size_t i = 0; i < lines.size(); ++i) {
        const config::Line& now = config.lines[i];
        const config::Line* before = find_same(*snapshot_->config, now, simulate_);
        if (known_.lines.emplace(std::pair(now.name, lines[i]->way()), lines[i]).second) {
            lines[i]->start();
        } else if (before == nullptr) {
            lines[i]->apply(now, now);
        } else if (*before != now) {
            lines[i]->apply(*before, now);
        }
    }
}

/// A reply to a request that another line has sent on the same wire belongs to none of this line's
/// clients: the line stays silent until no such reply can come any more (P1).
void Gateway::rest_wires(const config::Config& config, const Lines& lines) {
    for (std::size_t i = 0; i < lines.size(); ++i) {
        const std::string wire = explain::wire_of(config.lines[i]);
        const config::Line* before = find_same(*snapshot_->config, config.lines[i], simulate_);
        if (before != nullptr && explain::wire_of(*before) == wire) continue;
        for (const auto& [name, other] : known_.lines) {
            if (other != lines[i] && other->wires().contains(wire))
                lines[i]->bus().rest_until(other->bus().clear_at());
        }
    }
}

void Gateway::retire_lines(const Lines& lines) {
    for (std::size_t i = 0; i < snapshot_->lines.size(); ++i) {
        const auto& line = snapshot_->lines[i];
        if (std::ranges::find(lines, line) != lines.end()) continue;
        if (discoveries_) discoveries_->stop(snapshot_->config->lines[i].name);
        line->stop();
    }
}

/// Makes a snapshot the current one. Histories are kept only while HTTP is configured.
void Gateway::show(const std::shared_ptr<Snapshot>& snapshot) {
    if (snapshot->config->http) {
        if (!line_histories_)
            line_histories_ =
                std::make_unique<LineHistories>(clock_, std::vector<const bus::LineBus*>());
        keep_histories(*snapshot, snapshot_.get(), *line_histories_);
        snapshot->directory =
            directory_of(snapshot->plant, *snapshot->config->profiles->find("generic"));
        for (const images::Settings& image : snapshot->config->images)
            snapshot->directory.images.push_back({&image, layout_of(image, *snapshot->config)});
        for (std::size_t i = 0; i < snapshot->histories.size(); ++i)
            snapshot->directory.lines[i].history = snapshot->histories[i].get();
    }
    snapshot_ = snapshot;
    images_.show(snapshot_);
    audit_.show(snapshot_);
    journal_.show(snapshot_);
    northbound_.show(snapshot_);
}

void Gateway::apply(std::shared_ptr<const config::Config> config) {
    const auto before = std::exchange(configured_, config);
    standby_.apply(*config);
    try {
        serve(standby_.arrange(config));
    } catch (...) {
        configured_ = before;
        standby_.apply(*before);
        throw;
    }
}

RunningLine* Gateway::find_running(const std::string& line) {
    if (!snapshot_) return nullptr;
    const auto& lines = snapshot_->config->lines;
    const auto found = std::ranges::find(lines, line, &config::Line::name);
    if (found == lines.end()) return nullptr;
    return snapshot_->lines[static_cast<std::size_t>(found - lines.begin())].get();
}

void Gateway::tell_role(const std::string& line, const standby::Seat& seat) {
    const std::string role(label(seat.role()));
    const std::string why(seat.why());
    rt::log(rt::LogLevel::info, "standby", {{"line", line}, {"role", role}, {"why", why}});
    store::Entry entry{.kind = store::Kind::standby};
    entry.line = line;
    entry.text = role + ": " + why;
    journal_.add(std::move(entry));
}

/// Renders the configuration for REST.
std::function<std::string()> Gateway::shown() const {
    return [config = configured_] { return shown_text(*config); };
}

/// Serves this arrangement of the configuration.
void Gateway::serve(std::shared_ptr<const config::Config> config) {
    Lines lines = lines_of(*config);
    Plant draft;
    for (std::size_t i = 0; i < lines.size(); ++i)
        draft.add(config->lines[i], lines[i]->bus(), nullptr);
    images_.add_to(draft, *config);
    const auto directory = [this] { return directory_in(snapshot_); };
    servers_.open(*config, draft, {directory, [this] { return providers(); }});
    // Nothing below throws.
    const bool kept_nothing = line_histories_ == nullptr;
    audit_.tokens(tokens_of(*snapshot_->config), tokens_of(*config));
    doors_.change(config);
    rest_wires(*config, lines);
    retire_lines(lines);
    apply_lines(*config, lines);
    show(make_snapshot(std::move(config), std::move(lines), images_));
    std::erase_if(minutes_, [&all = snapshot_->config->lines](const auto& one) {
        return std::ranges::find(all, one.first, &config::Line::name) == all.end();
    });
    if (kept_nothing && line_histories_) line_histories_->start();
    relays_->apply(routes_of(*snapshot_));
    servers_.apply(*snapshot_->config, snapshot_->plant, directory_in(snapshot_), shown(),
                   longest_answer());
    judge_waiting();
    doors_.settle();
    watch_certificates();
    watch_expiry();
    apply_alarms();
    standby_.arranged();
}

void Gateway::apply_alarms() {
    alarms_.apply(snapshot_->config->alarms, plant_in(snapshot_));
    if (!hook_.apply(snapshot_->config->webhook)) return;
    for (const web::AlarmView& alarm : alarms_.list())
        if (alarm.status.is_active())
            hook_.on_change({alarms::Change::Kind::raised, &alarm.settings, alarm.status});
}

/// Of all lines: what is new at a door is about requests to any.
void Gateway::judge_waiting() {
    for (const auto& line : snapshot_->lines) line->bus().judge_waiting();
}

/// Closes connections whose certificate has expired, and records tokens that have expired since the
/// last look. The clock on the wall may be set, so it is looked at often.
void Gateway::watch_expiry() {
    using std::chrono::microseconds;  // Duration does not hold the years until some expire
    const WallTime now = rt::wall_now();
    microseconds pause = 1s;
    bool some = false;
    for (const web::Token& token : tokens_of(*snapshot_->config)) {
        if (!token.expires) continue;
        if (*token.expires > now) {
            pause = std::min<microseconds>(pause, *token.expires - now);
        } else if (*token.expires > expired_until_) {
            audit_.expired(token);
            some = true;
        }
    }
    expired_until_ = now;
    servers_.review();
    if (northbound_.counters()) ask_broker();
    if (some) judge_waiting();
    expiry_->arm(clock_.now() + pause, [this] { watch_expiry(); });
}

/// Brings the broker connection's counters to the plant's loop, so that findings tell a broker that
/// is away.
void Gateway::ask_broker() {
    boost::asio::post(loops_.faces, [collect = northbound_.collector(), plant = loops_.plant] {
        if (auto keep = collect()) boost::asio::post(plant, std::move(keep));
    });
}

void Gateway::watch_certificates() {
    const config::Config& config = *snapshot_->config;
    const bool any =
        (config.http && config.http->tls) || (config.mqtt && config.mqtt->tls) ||
        std::ranges::any_of(config.modbus_tcp, [](const auto& one) { return one.tls.has_value(); });
    if (any && !certificates_)
        certificates_ = std::make_unique<CertificateWatch>(
            loops_.plant, clock_, [this](const CertificateWatch::Served& served) {
                if (served.server.empty())
                    servers_.renew(served.listener, served.settings);
                else
                    northbound_.renew(served.settings.material);
            });
    if (certificates_) certificates_->follow(config);
}

std::vector<ServedCertificate> Gateway::certificates() const {
    if (!certificates_) return {};
    return certificates_->served();
}

void Gateway::record(const web::ReloadVerdict& verdict) {
    const bool was_kept = audit_.is_kept();
    if (was_kept) audit_.reload(verdict);
    audit_.apply(snapshot_->config->audit);
    journal_.apply(snapshot_->config->store);
    if (!was_kept) audit_.reload(verdict);
}

web::Providers Gateway::providers() {
    if (!discoveries_)
        discoveries_ = std::make_unique<Discoveries>(
            clock_,
            [this] { return Discoveries::Place{snapshot_->plant, snapshot_->config->profiles}; },
            events_);
    web::Providers providers;
    providers.figures = [this] { return metrics_text(); };
    providers.metrics_type = metrics::kContentType;
    providers.ready = [this] { return ready_ && servers_.missing().empty(); };
    providers.missing = [this] { return servers_.missing(); };
    providers.version = PANELGATE_VERSION;
    providers.commit = build_commit();
    providers.compiler = build_compiler();
    providers.libraries = build_libraries();
    providers.now = rt::AsioClock::read;
    providers.events = events_.hub();
    providers.relays = [this] { return relays_->status(); };
    providers.findings = [this] { return findings(); };
    providers.usage = [this] { return usage(); };
    providers.standby = [this] { return standby_.view(); };
    providers.wall = rt::wall_now;
    providers.collect = northbound_.collector();
    providers.discovery = discoveries_.get();
    providers.alarms = &alarms_;
    providers.reload = reloads_;
    providers.text = text_;
    providers.record = audit_.deeds();
    providers.ask_store = [this](std::function<void(const store::Database*)> read,
                                 std::function<void()> done) {
        journal_.ask(std::move(read), std::move(done));
    };
    providers.write_history = [this](const std::string& point) { journal_.flush(point); };
    return providers;
}

void Gateway::start() {
    const auto directory = [this] { return directory_in(snapshot_); };
    // First what may throw: nothing is sent to a panel where a port is taken. No client is served
    // before this returns.
    servers_.open(*snapshot_->config, snapshot_->plant,
                  {directory, [this] { return providers(); }});
    lag_.start();
    audit_.apply(snapshot_->config->audit);
    journal_.apply(snapshot_->config->store);
    findings_.on_change(
        [this](const web::Finding& finding, bool is_new) { on_finding(finding, is_new); });
    audit_.on_record([this](const audit::Members& record) { journal_.on_record(record); });
    hook_.apply(snapshot_->config->webhook);
    alarms_.apply(snapshot_->config->alarms, plant_in(snapshot_));
    journal_.add(
        {.kind = store::Kind::start, .text = std::string("panelgate ") + PANELGATE_VERSION});
    for (const auto& line : snapshot_->lines) {
        line->start();
        line->record_minute();
    }
    relays_->start();
    if (line_histories_) line_histories_->start();
    servers_.apply(*snapshot_->config, snapshot_->plant, directory(), shown(), longest_answer());
    northbound_.start([this] { alarms_.announce_all(); });
    watch_certificates();
    expired_until_ = rt::wall_now();
    watch_expiry();
    look_for_findings();
    ready_ = true;
}

Duration Gateway::longest_answer() const {
    Duration longest{};
    for (const config::Line& line : snapshot_->config->lines)
        longest = std::max(longest, line.arbiter.queue.deadline);
    return longest;
}

void Gateway::stop_accepting() {
    ready_ = false;
    if (discoveries_) discoveries_->stop_all();
    events_.end();
    servers_.stop_accepting(longest_answer());
}

bool Gateway::drained() {
    if (!servers_.drained()) return false;
    northbound_.stop();
    return northbound_.left();
}

std::string Gateway::status() const {
    return service_status(snapshot_->plant, servers_.listening(), servers_.missing());
}

void Gateway::stop() {
    lag_.stop();
    expiry_->cancel();
    looking_->cancel();
    if (certificates_) certificates_->stop();
    servers_.close();
    standby_.stop();
    northbound_.stop();
    if (line_histories_) line_histories_->stop();
    relays_->stop();
    for (const auto& line : snapshot_->lines) line->stop();
    audit_.close();
    alarms_.stop();
    hook_.stop();
    journal_.add({.kind = store::Kind::stop});
    journal_.close();
}

}  // namespace panelgate::gateway
