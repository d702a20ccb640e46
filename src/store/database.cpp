#include "panelgate/store/database.hpp"

#include <sqlite3.h>
#include <algorithm>
#include <filesystem>
#include <iterator>
#include <limits>
#include <map>
#include <stdexcept>

#include "statement.hpp"

namespace panelgate::store {

namespace {

/// The schema by steps: PRAGMA user_version counts those that a file has.
constexpr const char* kSteps[] = {
    "CREATE TABLE event (id INTEGER PRIMARY KEY AUTOINCREMENT, time INTEGER NOT NULL,"
    " kind TEXT NOT NULL, severity TEXT NOT NULL, line TEXT NOT NULL, station TEXT NOT NULL,"
    " point TEXT NOT NULL, who TEXT NOT NULL, text TEXT NOT NULL, data TEXT NOT NULL);"
    "CREATE INDEX event_time ON event (time);"
    "CREATE TABLE point (id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE);"
    "CREATE TABLE sample (block INTEGER NOT NULL, point INTEGER NOT NULL, data BLOB NOT NULL,"
    " PRIMARY KEY (block, point)) WITHOUT ROWID;"
    "CREATE TABLE kept (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;"};

constexpr int kPatienceMs = 1000;                // for another program that reads the file
constexpr auto kPruned = std::chrono::hours(6);  // go at a time while the file is nearly full

std::int64_t micros_of(WallTime time) { return time.time_since_epoch().count(); }
WallTime time_of(std::int64_t micros) { return WallTime(WallTime::duration(micros)); }

Entry entry_of(const Statement& row) {
    Entry entry;
    entry.id = row.integer(0);
    entry.time = time_of(row.integer(1));
    entry.kind = kind_of(row.text(2)).value_or(Kind::start);
    entry.severity = row.text(3);
    entry.line = row.text(4);
    entry.station = row.text(5);
    entry.point = row.text(6);
    entry.who = row.text(7);
    entry.text = row.text(8);
    entry.data = row.text(9);
    return entry;
}

bool is_asked_for(const JournalQuery& query, const Entry& entry) {
    if (!query.kinds.empty() && std::ranges::find(query.kinds, entry.kind) == query.kinds.end())
        return false;
    if (!query.station.empty() && entry.station != query.station) return false;
    return !query.may_see || query.may_see(entry);
}

/// Adds a slot to the step that the slot's time lies in.
void add_to(std::vector<HistorySample>& samples, const HistoryQuery& query, WallTime time,
            const Summary& slot) {
    if (slot.count == 0) return;
    const WallTime begin = query.from + (time - query.from) / query.step * query.step;
    if (samples.empty() || samples.back().time != begin) {
        if (samples.size() == HistoryQuery::kSamples) return;
        samples.push_back({begin, {}});
    }
    samples.back().values.add(slot);
}

}  // namespace

struct Database::Handle {
    ~Handle() {
        statements.clear();
        sqlite3_close(database);
    }
    /// A statement is prepared once.
    Statement& get(const char* sql) {
        auto& statement = statements[sql];
        if (!statement) statement = std::make_unique<Statement>(database, sql);
        statement->reset();
        return *statement;
    }

    sqlite3* database = nullptr;
    std::map<std::string, std::unique_ptr<Statement>, std::less<>> statements{};
    std::map<std::string, std::int64_t, std::less<>> points{};  ///< ids by name
};

Database::Database(const Settings& settings) : settings_(settings) {
    try {
        open();
    } catch (const SqlError& error) {
        if (!error.is_damage() || settings_.file.empty()) throw;
        set_aside(error.what());
        open();
    }
}

Database::~Database() = default;

void Database::open() {
    handle_ = std::make_unique<Handle>();
    const std::string name = settings_.file.empty() ? ":memory:" : settings_.file;
    const int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX;
    if (sqlite3_open_v2(name.c_str(), &handle_->database, flags, nullptr) != SQLITE_OK)
        throw SqlError(handle_->database, "cannot open " + name);
    sqlite3_busy_timeout(handle_->database, kPatienceMs);
    Statement check(handle_->database, "PRAGMA quick_check(1)");
    check.step();
    if (check.text(0) != "ok") throw SqlError(check.text(0), SQLITE_CORRUPT);
    check.reset();
    run("PRAGMA journal_mode = WAL; PRAGMA synchronous = NORMAL;"
        "PRAGMA journal_size_limit = 4194304");
    run("PRAGMA cache_size = -" + std::to_string(settings_.cache / 1024));  // negative: in KiB
    run("PRAGMA max_page_count = " +
        std::to_string(static_cast<std::int64_t>(settings_.size) / page_size()));
    prepare_tables();
}

void Database::prepare_tables() {
    const auto steps = static_cast<std::int64_t>(std::size(kSteps));
    const std::int64_t done = number("PRAGMA user_version");
    if (done > steps)
        throw std::runtime_error(settings_.file + " was written by a newer panelgate (schema " +
                                 std::to_string(done) + ")");
    in_transaction([&] {
        for (std::int64_t step = done; step < steps; ++step) run(kSteps[step]);
        run("PRAGMA user_version = " + std::to_string(steps));
    });
}

/// Renames the file and what SQLite keeps beside the file.
void Database::set_aside(const std::string& why) {
    handle_.reset();
    std::string to = settings_.file + ".damaged";
    for (int i = 2; std::filesystem::exists(to); ++i)
        to = settings_.file + ".damaged-" + std::to_string(i);
    std::filesystem::rename(settings_.file, to);
    for (const char* const beside : {"-wal", "-shm"}) {
        std::error_code none;
        std::filesystem::rename(settings_.file + beside, to + beside, none);
    }
    remark_ = settings_.file + " is kept as " + to + ", and a new one begins: " + why;
}

void Database::run(const std::string& sql) const {
    if (sqlite3_exec(handle_->database, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK)
        throw SqlError(handle_->database, "cannot write " + settings_.file);
}

std::int64_t Database::number(const std::string& sql) const {
    Statement statement(handle_->database, sql);
    return statement.step() ? statement.integer(0) : 0;
}

void Database::in_transaction(const std::function<void()>& work) {
    run("BEGIN IMMEDIATE");
    try {
        work();
        run("COMMIT");
    } catch (...) {
        handle_->points.clear();
        sqlite3_exec(handle_->database, "ROLLBACK", nullptr, nullptr, nullptr);
        throw;
    }
}

void Database::add(const Entry& entry) {
    Statement& row = handle_->get(
        "INSERT INTO event (time, kind, severity, line, station, point, who, text, data)"
        " VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)");
    row.bind(1, micros_of(entry.time)).bind(2, label(entry.kind)).bind(3, entry.severity);
    row.bind(4, entry.line).bind(5, entry.station).bind(6, entry.point).bind(7, entry.who);
    row.bind(8, entry.text).bind(9, entry.data).run();
}

JournalPage Database::journal(const JournalQuery& query) const {
    Statement& row = handle_->get(
        "SELECT id, time, kind, severity, line, station, point, who, text, data FROM event"
        " WHERE time >= ? AND time < ? AND id < ? ORDER BY id DESC");
    row.bind(1, query.since ? micros_of(*query.since) : 0);
    row.bind(2, query.until ? micros_of(*query.until) : std::numeric_limits<std::int64_t>::max());
    row.bind(3, query.after > 0 ? query.after : std::numeric_limits<std::int64_t>::max());
    JournalPage page;
    while (row.step()) {
        Entry entry = entry_of(row);
        if (!is_asked_for(query, entry)) continue;
        if (page.entries.size() == std::min(query.limit, JournalQuery::kLimit)) {
            page.next = page.entries.back().id;
            break;
        }
        page.entries.push_back(std::move(entry));
    }
    row.reset();
    return page;
}

std::int64_t Database::point_id(std::string_view point) {
    if (const auto known = handle_->points.find(point); known != handle_->points.end())
        return known->second;
    handle_->get("INSERT INTO point (name) VALUES (?) ON CONFLICT DO NOTHING").bind(1, point).run();
    Statement& row = handle_->get("SELECT id FROM point WHERE name = ?");
    row.bind(1, point).step();
    const std::int64_t id = row.integer(0);
    row.reset();
    handle_->points.emplace(point, id);
    return id;
}

std::optional<Block> Database::block_of(std::int64_t point, std::int64_t number) const {
    Statement& row = handle_->get("SELECT data FROM sample WHERE block = ? AND point = ?");
    row.bind(1, number).bind(2, point);
    std::optional<Block> block;
    if (row.step()) block = Block::parse(row.text(0));
    row.reset();
    return block;
}

void Database::add(std::string_view point, std::int64_t number, const Block& block) {
    const std::int64_t id = point_id(point);
    Block whole = block;
    if (const auto before = block_of(id, number)) whole.add(*before);
    handle_->get("INSERT OR REPLACE INTO sample (block, point, data) VALUES (?, ?, ?)")
        .bind(1, number)
        .bind(2, id)
        .bind_blob(3, whole.bytes())
        .run();
}

std::vector<HistorySample> Database::history(const HistoryQuery& query) const {
    std::vector<HistorySample> samples;
    Statement& point = handle_->get("SELECT id FROM point WHERE name = ?");
    const bool is_known = point.bind(1, query.point).step();
    const std::int64_t id = is_known ? point.integer(0) : 0;
    point.reset();
    const std::int64_t first = std::max(Block::number_of(query.from), oldest_block());
    const WallTime end = std::min(query.to, Block::begin_of(newest_block() + 1));
    for (std::int64_t number = first; is_known && Block::begin_of(number) < end; ++number) {
        const auto block = block_of(id, number);
        for (std::size_t i = 0; block && i < Block::kSlots; ++i) {
            const WallTime time =
                Block::begin_of(number) + static_cast<std::int64_t>(i) * Block::kSlot;
            if (time >= query.from && time < query.to)
                add_to(samples, query, time, block->slots()[i]);
        }
    }
    return samples;
}

void Database::keep(std::string_view key, std::string_view text) {
    if (text.empty()) return handle_->get("DELETE FROM kept WHERE key = ?").bind(1, key).run();
    handle_->get("INSERT OR REPLACE INTO kept (key, value) VALUES (?, ?)")
        .bind(1, key)
        .bind(2, text)
        .run();
}

std::vector<std::pair<std::string, std::string>> Database::kept(std::string_view prefix) const {
    Statement& row = handle_->get("SELECT key, value FROM kept WHERE key >= ? ORDER BY key");
    row.bind(1, prefix);
    std::vector<std::pair<std::string, std::string>> found;
    while (row.step() && row.text(0).starts_with(prefix))
        found.emplace_back(row.text(0), row.text(1));
    row.reset();
    return found;
}

std::int64_t Database::page_size() const { return number("PRAGMA page_size"); }

std::int64_t Database::oldest_block() const { return number("SELECT min(block) FROM sample"); }

std::int64_t Database::newest_block() const { return number("SELECT max(block) FROM sample"); }

std::uint64_t Database::bytes() const {
    return static_cast<std::uint64_t>(number("PRAGMA page_count") * page_size());
}

bool Database::is_nearly_full() const {
    const std::int64_t used = number("PRAGMA page_count") - number("PRAGMA freelist_count");
    return used * page_size() > static_cast<std::int64_t>(settings_.size / 10 * 9);
}

void Database::drop_before(WallTime time) {
    handle_->get("DELETE FROM sample WHERE block < ?").bind(1, Block::number_of(time)).run();
    handle_->get("DELETE FROM event WHERE time < ?").bind(1, micros_of(time)).run();
}

void Database::prune(WallTime now) {
    drop_before(now - std::chrono::days(settings_.days));
    while (is_nearly_full()) {
        const std::int64_t event = number("SELECT min(time) FROM event");
        const std::int64_t block = oldest_block();
        if (event == 0 && block == 0) return;
        WallTime oldest = block == 0 ? time_of(event) : Block::begin_of(block);
        if (event != 0) oldest = std::min(oldest, time_of(event));
        drop_before(oldest + kPruned);
    }
}

}  // namespace panelgate::store
