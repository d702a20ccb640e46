#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::audit {

enum class Kind : std::uint8_t {
    start,      ///< the gateway has started
    end,        ///< ... and ends in order
    write,      ///< a write, whatever became of it
    refusal,    ///< a request that was refused
    repeats,    ///< how often one client repeated what is recorded above
    login,      ///< a log-in that failed
    reload,     ///< reload or rollback
    discovery,  ///< a search for stations
    simulator,  ///< a fault of a simulated panel was set
    token,      ///< a token came, went, changed or expired
    file,       ///< a file begins
    lost,       ///< records were left out: the disk took nothing for too long
};
/// Returns "start", "end", "write", ...: stable identifiers.
std::string_view label(Kind kind);
std::vector<std::string> kind_labels();

/// Appends `text` as a JSON string. Bytes that are no UTF-8 become U+FFFD.
void append_json(std::string& out, std::string_view text);
/// Appends the contents of a JSON string, without its quotes.
void append_json_text(std::string& out, std::string_view text);

/// A member of a record: `,"key":"value"`.
std::string member(std::string_view key, std::string_view value);

/// Composes the body of one record, `"time":"...","kind":"write",...`, in a buffer that is used
/// again and again: nothing is allocated once it has grown. Number and hash are added by the chain.
class Composer {
  public:
    Composer& begin(WallTime time, Kind kind);
    /// An empty text is left out.
    Composer& text(std::string_view key, std::string_view value);
    /// A text of ours, in which nothing needs to be escaped: an identifier.
    Composer& word(std::string_view key, std::string_view value);
    Composer& number(std::string_view key, std::uint64_t value);
    Composer& flag(std::string_view key, bool value);
    Composer& time(std::string_view key, WallTime value);
    Composer& hex(std::string_view key, ByteView bytes);
    Composer& numbers(std::string_view key, std::span<const std::uint16_t> values);
    Composer& texts(std::string_view key, std::span<const std::string> values);

    /// Members that were composed before: `,"client":"..."`.
    Composer& members(std::string_view composed);

    std::string_view body() const { return body_; }

  private:
    void key(std::string_view key);

    std::string body_;
    std::int64_t second_ = -1;  ///< the second whose text is `date_`
    std::string date_;          ///< "2026-11-26T09:00:00"
    void append_time(WallTime time);
};

/// Members of a record, composed apart, for Composer::members(): `,"client":"..."`.
template <class Add>
std::string members_by(const Add& add) {
    Composer part;
    add(part);
    return std::string(part.body());
}

}  // namespace panelgate::audit
