#include "panelgate/gateway/journal.hpp"

#include <unistd.h>
#include <algorithm>
#include <boost/asio/post.hpp>
#include <boost/json/serialize.hpp>
#include <cstdlib>
#include <filesystem>
#include <utility>
#include <variant>

#include "panelgate/gateway/snapshot.hpp"
#include "panelgate/points/station_points.hpp"
#include "panelgate/rt/log.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::gateway {

namespace json = boost::json;

namespace {

constexpr Duration kJournalLook = 1s;
constexpr std::size_t kBlocks = 100;  // that are handed over at a look, so that a look is short
constexpr std::uint64_t kInMemory = 8 * 1024 * 1024;  // bytes of a store without a file
constexpr std::size_t kPointsInMemory = 2000;         // whose last hour has room in these bytes
constexpr std::string_view kFinding = "finding: ";
constexpr std::string_view kFindingGone = "finding gone: ";

/// Which records of the audit are entries, and as what.
std::optional<store::Kind> kind_of(const audit::Members& record) {
    const std::string kind = web::member_text(record, "kind");
    if (kind == "write") return store::Kind::write;
    if (kind == "refusal") return store::Kind::refused;
    if (kind == "login") return store::Kind::login_failed;
    if (kind == "reload") return store::Kind::reload;
    if (kind == "discovery") return store::Kind::discovery;
    return std::nullopt;
}

/// The items that a record names under `key`, as decode() takes them.
std::vector<std::uint16_t> items_in(const audit::Members& record, std::string_view key) {
    std::vector<std::uint16_t> items;
    const json::value* const value = record.if_contains(key);
    const auto* const list = value != nullptr ? value->if_array() : nullptr;
    if (list == nullptr) return items;
    for (const json::value& item : *list) items.push_back(item.to_number<std::uint16_t>());
    return items;
}

/// The point that a write has written as a whole; null if there is none.
const points::Point* point_of(const Snapshot* snapshot, const audit::Members& record) {
    const Station* const station =
        snapshot != nullptr ? snapshot->plant.find(web::member_text(record, "station")) : nullptr;
    const json::value* const address = record.if_contains("address");
    const json::value* const count = record.if_contains("count");
    if (station == nullptr || !station->points || address == nullptr || count == nullptr)
        return nullptr;
    const std::string table = web::member_text(record, "table");
    for (const points::Point& point : station->points->points())
        if (modbus::label(point.table) == table && *address == point.address &&
            *count == point.count())
            return &point;
    return nullptr;
}

/// "21.5", as the point shows the items; "5" or "5, 6" without a point; "" without items.
std::string value_text(const points::Point* point, const std::vector<std::uint16_t>& items) {
    if (items.empty()) return {};
    if (point != nullptr && items.size() == point->count())
        if (const auto value = points::decode(*point, items)) return points::to_string(*value);
    std::string text;
    for (const std::uint16_t item : items)
        text += (text.empty() ? "" : ", ") + std::to_string(item);
    return text;
}

/// "temperature = 21.5, was 20 (confirmed)".
std::string write_text(const audit::Members& record, const points::Point* point) {
    std::string text = point != nullptr ? point->name : web::member_text(record, "at");
    if (const std::string now = value_text(point, items_in(record, "values")); !now.empty())
        text += " = " + now;
    if (const std::string before = value_text(point, items_in(record, "before")); !before.empty())
        text += ", was " + before;
    const std::string why = web::member_text(record, "why");
    return text + " (" + web::member_text(record, "outcome") + (why.empty() ? "" : ": " + why) +
           ')';
}

std::string other_text(const audit::Members& record) {
    std::string text;
    for (const std::string_view key : {"method", "path", "at", "outcome", "cause", "rule", "why"}) {
        const std::string part = web::member_text(record, key);
        const bool is_who = key == "cause" && web::member_text(record, "kind") == "reload";
        if (!part.empty() && !is_who) text += (text.empty() ? "" : " ") + part;
    }
    return text;
}

bool is_refusal(store::Kind kind) {
    return kind == store::Kind::refused || kind == store::Kind::login_failed;
}

}  // namespace

std::string store_file(const store::Settings& settings) {
    if (!settings.file.empty()) return settings.file;
    const char* const given = std::getenv("STATE_DIRECTORY");
    if (given == nullptr || *given == '\0') return {};
    const std::string all = given;
    const std::filesystem::path folder = all.substr(0, all.find(':'));
    if (::access(folder.c_str(), W_OK | X_OK) != 0) return {};
    return folder / "state.db";
}

Journal::Journal(boost::asio::any_io_executor executor, rt::Clock& clock)
    : executor_(std::move(executor)), clock_(clock), alarm_(clock.make_alarm()) {}

Journal::~Journal() { close(); }

void Journal::apply(const store::Settings& settings) {
    store::Settings now = settings;
    now.file = store_file(settings);
    if (now.file.empty()) {
        now.size = std::min(now.size, kInMemory);
        now.points = std::min(now.points, kPointsInMemory);
    }
    if (store_ && now == settings_) return;
    if (store_) {
        if (!closing_) closing_.emplace(executor_);
        const std::shared_ptr<store::Store> last = std::move(store_);
        closing_->run([last]() mutable { last->end(); }, [] {});
    }
    settings_ = now;
    store_ =
        std::make_unique<store::Store>(settings_, rt::wall_now,
                                       [this, executor = executor_, life = std::weak_ptr(alive_)](
                                           bool failing, const std::string& why) {
                                           boost::asio::post(executor, [this, life, failing, why] {
                                               if (!life.expired()) tell(failing, why);
                                           });
                                       });
    alarm_->cancel();
    look();
}

void Journal::close() {
    if (!store_) return;
    alarm_->cancel();
    for (auto& [point, running] : blocks_) write(point, running);
    blocks_.clear();
    store_.reset();
}

void Journal::tell(bool failing, const std::string& why) const {
    if (failing)
        rt::log(rt::LogLevel::warn, "store fails", {{"file", settings_.file}, {"why", why}});
    else if (!why.empty())
        rt::log(rt::LogLevel::warn, "store file", {{"file", settings_.file}, {"why", why}});
    else
        rt::log(rt::LogLevel::info, "store writes", {{"file", settings_.file}});
}

std::optional<store::Counters> Journal::counters() const {
    if (!store_) return std::nullopt;
    return store_->counters();
}

void Journal::add(store::Entry entry) {
    if (!store_) return;
    entry.time = rt::wall_now();
    store_->put([entry = std::move(entry)](store::Database& to) { to.add(entry); });
}

void Journal::keep(const std::string& key, const std::string& text) {
    if (store_) store_->put([key, text](store::Database& to) { to.keep(key, text); });
}

void Journal::on_event(const std::string& line, const bus::BusEvent& event) {
    if (const auto* of_line = std::get_if<bus::LineEvent>(&event)) on_line(line, *of_line);
    if (const auto* of_station = std::get_if<arbiter::StationEvent>(&event))
        on_station(line, *of_station);
}

void Journal::on_line(const std::string& line, const bus::LineEvent& event) {
    store::Entry entry;
    entry.line = line;
    entry.text = event.why;
    const bool is_gone = event.why.starts_with(kFindingGone);
    if (is_gone || event.why.starts_with(kFinding)) {
        entry.kind = is_gone ? store::Kind::finding_gone : store::Kind::finding;
        entry.text.erase(0, is_gone ? kFindingGone.size() : kFinding.size());
        if (event.station != 0 && snapshot_)
            entry.station = snapshot_->plant.name_of(line, event.station);
    } else {
        const auto known = lines_.find(line);
        if (known != lines_.end() && known->second == event.up) return;
        lines_[line] = event.up;
        entry.kind = event.up ? store::Kind::line_up : store::Kind::line_down;
    }
    const bool is_good = is_gone || entry.kind == store::Kind::line_up;
    entry.severity = is_good ? "info" : "warning";
    add(std::move(entry));
}

void Journal::on_station(const std::string& line, const arbiter::StationEvent& event) {
    using Event = arbiter::StationEvent::Kind;
    if (event.kind != Event::online && event.kind != Event::offline) return;
    const bool online = event.kind == Event::online;
    store::Entry entry;
    entry.kind = online ? store::Kind::station_online : store::Kind::station_offline;
    entry.severity = online ? "info" : "warning";
    entry.line = line;
    if (snapshot_) entry.station = snapshot_->plant.name_of(line, event.station);
    add(std::move(entry));
}

void Journal::on_record(const audit::Members& record) {
    const auto kind = kind_of(record);
    // A relay writes all day; its state is a finding's affair.
    if (!kind || web::member_text(record, "face") == "gateway") return;
    const bool is_write = *kind == store::Kind::write;
    const points::Point* const point = is_write ? point_of(snapshot_.get(), record) : nullptr;
    store::Entry entry;
    entry.kind = *kind;
    entry.severity = is_refusal(*kind) ? "warning" : "info";
    entry.line = web::member_text(record, "line");
    entry.station = web::member_text(record, "station");
    if (point != nullptr) entry.point = point->name;
    entry.who = web::member_text(record, *kind == store::Kind::reload ? "cause" : "client");
    entry.text = is_write ? write_text(record, point) : other_text(record);
    entry.data = json::serialize(record);
    add(std::move(entry));
}

void Journal::on_points(const Station& station, const std::vector<std::size_t>& wants) {
    if (!store_ || !station.points) return;
    const WallTime wall = rt::wall_now();
    const std::int64_t number = store::Block::number_of(wall);
    auto& places = places_[&station];
    for (const std::size_t want : wants) {
        const points::Point* const point = station.points->point_of(want);
        if (point == nullptr) continue;
        const auto value = station.points->read(*point, clock_.now()).good_number();
        if (!value) continue;
        if (places.size() <= want) places.resize(want + 1);
        if (places[want] == nullptr) places[want] = block_of(station, *point);
        if (places[want] == nullptr) continue;
        auto& [name, running] = *places[want];
        if (running.number != number) write(name, running);
        running.number = number;
        running.block.add(wall, *value);
    }
}

/// Returns null where so many points are kept already.
Journal::Blocks::value_type* Journal::block_of(const Station& station, const points::Point& point) {
    const std::string name = station.name + '/' + point.name;
    const auto known = blocks_.find(name);
    if (known != blocks_.end()) return &*known;
    if (blocks_.size() < settings_.points) return &*blocks_.try_emplace(name).first;
    if (!std::exchange(told_full_, true))
        rt::log(rt::LogLevel::warn, "history is full",
                {{"points", std::to_string(settings_.points)},
                 {"why", "no values of days are kept of further points"}});
    return nullptr;
}

/// Hands a block over, and empties the block.
void Journal::write(const std::string& point, Running& running) {
    const Running full = std::exchange(running, {});
    if (full.number == 0) return;
    store_->put([point, full](store::Database& to) { to.add(point, full.number, full.block); });
}

/// Hands over blocks whose five minutes have passed.
void Journal::look() {
    const std::int64_t number = store::Block::number_of(rt::wall_now());
    std::size_t some = 0;
    for (auto at = blocks_.begin(); at != blocks_.end() && some < kBlocks;) {
        if (at->second.number >= number) {
            ++at;
            continue;
        }
        write(at->first, at->second);
        at = blocks_.erase(at);
        places_.clear();
        ++some;
    }
    alarm_->arm(clock_.now() + kJournalLook, [this] { look(); });
}

void Journal::ask(std::function<void(const store::Database*)> read, std::function<void()> done) {
    const auto answer = [executor = executor_, read = std::move(read),
                         done = std::move(done)](const store::Database* from) {
        read(from);
        boost::asio::post(executor, done);
    };
    if (!store_) return answer(nullptr);
    store_->ask(answer);
}

void Journal::ask_kept(std::string_view prefix, std::function<void(const Texts&)> done) {
    const auto kept = std::make_shared<Texts>();
    ask(
        [kept, prefix = std::string(prefix)](const store::Database* from) {
            if (from != nullptr) *kept = from->kept(prefix);
        },
        [kept, done = std::move(done)] { done(*kept); });
}

void Journal::flush(const std::string& point) {
    const auto running = blocks_.find(point);
    if (store_ && running != blocks_.end()) write(point, running->second);
}

}  // namespace panelgate::gateway
