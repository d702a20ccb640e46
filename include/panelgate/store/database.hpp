#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/store/blocks.hpp"
#include "panelgate/store/entry.hpp"
#include "panelgate/store/settings.hpp"

namespace panelgate::store {

/// The SQLite file: journal, history, texts by key, and what waits for a broker. One thread. A call
/// that the disk refuses throws std::runtime_error with SQLite's words.
class Database {
  public:
    /// Opens the file, or makes one. A damaged file is set aside first; remark() tells where.
    explicit Database(const Settings& settings);
    ~Database();
    Database(const Database&) = delete;
    Database& operator=(const Database&) = delete;

    /// Runs `work` in one transaction. If `work` throws, the transaction leaves nothing behind.
    void in_transaction(const std::function<void()>& work);

    void add(const Entry& entry);
    JournalPage journal(const JournalQuery& query) const;

    /// Adds a block of a point, "STATION/POINT", to what is there for the same five minutes.
    void add(std::string_view point, std::int64_t number, const Block& block);
    std::vector<HistorySample> history(const HistoryQuery& query) const;

    /// Keeps a text under a key; "" forgets the key.
    void keep(std::string_view key, std::string_view text);
    /// All keys that begin with `prefix`, and their texts.
    std::vector<std::pair<std::string, std::string>> kept(std::string_view prefix) const;

    /// Drops what is older than Settings::days, and the oldest while the file is nearly full.
    void prune(WallTime now);
    std::uint64_t bytes() const;
    /// What should be said of the file that was found; "": nothing.
    const std::string& remark() const { return remark_; }

  private:
    struct Handle;

    void open();
    void prepare_tables();
    void set_aside(const std::string& why);
    void run(const std::string& sql) const;
    std::int64_t number(const std::string& sql) const;
    std::int64_t point_id(std::string_view point);
    std::optional<Block> block_of(std::int64_t point, std::int64_t number) const;
    std::int64_t page_size() const;
    std::int64_t oldest_block() const;
    std::int64_t newest_block() const;
    bool is_nearly_full() const;
    void drop_before(WallTime time);

    Settings settings_;
    std::unique_ptr<Handle> handle_;
    std::string remark_;
};

}  // namespace panelgate::store
