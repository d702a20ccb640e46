#pragma once

#include <sqlite3.h>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

namespace panelgate::store {

/// What SQLite refuses, in its words.
class SqlError : public std::runtime_error {
  public:
    SqlError(sqlite3* database, const std::string& what)
        : std::runtime_error(what + ": " + sqlite3_errmsg(database)),
          code_(sqlite3_errcode(database)) {}
    SqlError(const std::string& what, int code) : std::runtime_error(what), code_(code) {}
    /// A primary result code, such as SQLITE_FULL.
    int code() const { return code_; }
    /// True if the file is no database, or a broken one.
    bool is_damage() const { return code_ == SQLITE_CORRUPT || code_ == SQLITE_NOTADB; }

  private:
    int code_;
};

/// A prepared statement. Parameters count from 1, columns from 0. Errors are SqlError.
class Statement {
  public:
    Statement(sqlite3* database, std::string_view sql) : database_(database) {
        if (sqlite3_prepare_v2(database, sql.data(), static_cast<int>(sql.size()), &statement_,
                               nullptr) != SQLITE_OK)
            throw SqlError(database, "prepare");
    }
    ~Statement() { sqlite3_finalize(statement_); }
    Statement(const Statement&) = delete;
    Statement& operator=(const Statement&) = delete;

    Statement& bind(int index, std::int64_t value) {
        check(sqlite3_bind_int64(statement_, index, value));
        return *this;
    }
    Statement& bind(int index, std::string_view text) {
        check(sqlite3_bind_text(statement_, index, text.data(), static_cast<int>(text.size()),
                                SQLITE_TRANSIENT));
        return *this;
    }
    Statement& bind_blob(int index, std::string_view bytes) {
        check(sqlite3_bind_blob(statement_, index, bytes.data(), static_cast<int>(bytes.size()),
                                SQLITE_TRANSIENT));
        return *this;
    }
    /// Returns false behind the last row.
    bool step() {
        const int result = sqlite3_step(statement_);
        if (result != SQLITE_ROW && result != SQLITE_DONE)
            throw SqlError(database_, "write or read");
        return result == SQLITE_ROW;
    }
    /// Carries the statement out, and makes it ready for other parameters.
    void run() {
        while (step()) {
        }
        reset();
    }
    void reset() { sqlite3_reset(statement_); }

    std::int64_t integer(int column) const { return sqlite3_column_int64(statement_, column); }
    std::string text(int column) const {
        const void* const bytes = sqlite3_column_blob(statement_, column);
        const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_, column));
        return bytes == nullptr ? std::string()
                                : std::string(static_cast<const char*>(bytes), size);
    }

  private:
    void check(int result) {
        if (result != SQLITE_OK) throw SqlError(database_, "bind");
    }

    sqlite3* database_;
    sqlite3_stmt* statement_ = nullptr;
};

}  // namespace panelgate::store
