#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "panelgate/base/sha256.hpp"

namespace panelgate::audit {

/// Where a chain stands: the number and the hash of its last record (64 lower-case hex digits).
/// Number 0: no record; the first record follows 64 times '0'.
struct Position {
    std::uint64_t number = 0;
    std::string hash = std::string(64, '0');
    friend bool operator==(const Position&, const Position&) = default;
};

/// Makes records of bodies: `{"n":N,BODY,"hash":"H"}` and a newline. H is SHA-256 of the previous
/// record's H (its 64 digits) and this line up to `,"hash"`. Whoever has the files can check it
/// with any tool; no key is needed, and none can be stolen.
class Chain {
  public:
    explicit Chain(const Position& last = {}) : last_(last) {}

    void append(std::string& out, std::string_view body);
    const Position& last() const { return last_; }

  private:
    Position last_;
    Sha256 digest_;
};

/// The parts of a line; views of it.
struct Sealed {
    std::uint64_t number = 0;
    std::string_view text;  ///< what the hash covers besides the previous hash
    std::string_view body;  ///< without the number
    std::string_view hash;
};
/// Takes a line, without its newline, apart. nullopt if it is no record.
std::optional<Sealed> parse_line(std::string_view line);
/// True for the beginning of a record, however short, as a crash leaves it. Pure.
bool is_beginning(std::string_view line);
/// The value of a member of a body that is a number, a flag or a text without escapes; "" if there
/// is none. What is inside of texts is no member: quotes are escaped there.
std::string_view member_of(std::string_view body, std::string_view key);
/// Where a file's end is, as far as the chain is concerned.
struct Tail {
    Position last{};        ///< its last line that is whole; number 0: none, or no record
    std::string_view torn;  ///< what follows the last newline
    bool ended = false;     ///< the last record is of kind `end`
};
/// `end`: the end of a file, at least its last line. Pure.
Tail parse_tail(std::string_view end);

}  // namespace panelgate::audit
