#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "panelgate/base/pool.hpp"

namespace panelgate {

using Bytes = PoolVector<std::uint8_t>;
using ByteView = std::span<const std::uint8_t>;

/// Reads big-endian fields from bytes it does not own. A read past the end returns 0 and sets a
/// sticky failure flag: check ok() or finished() once, at the end.
class Reader {
  public:
    explicit Reader(ByteView bytes) : bytes_(bytes) {}

    std::uint8_t u8();
    std::uint16_t u16();
    /// Returns the next n bytes; empty on failure.
    ByteView take(std::size_t n);

    std::size_t left() const { return bytes_.size() - at_; }
    bool ok() const { return ok_; }
    /// True if every byte was read and no read went past the end.
    bool finished() const { return ok_ && left() == 0; }

  private:
    ByteView bytes_;
    std::size_t at_ = 0;
    bool ok_ = true;
};

/// Appends big-endian fields.
class Writer {
  public:
    /// `expected`: bytes to reserve; not a limit.
    explicit Writer(std::size_t expected = 16) { bytes_.reserve(expected); }
    Writer& u8(unsigned value);
    Writer& u16(unsigned value);
    Writer& raw(ByteView bytes);
    Bytes take() { return std::move(bytes_); }

  private:
    Bytes bytes_;
};

/// Appends as much of `more` as fits into a total of `limit` bytes; drops the rest.
void append_up_to(std::size_t limit, Bytes& bytes, ByteView more);

/// Returns lower-case hex: "1f 03 00"; with an empty separator "1f0300".
std::string to_hex(ByteView bytes, std::string_view separator = " ");
/// Parses pairs of hex digits, blanks allowed between pairs; std::nullopt for anything else.
std::optional<Bytes> from_hex(std::string_view text);

/// Queue of stream bytes not yet taken. Each byte is moved a constant number of times. The caller
/// bounds its size.
class ByteQueue {
  public:
    void feed(ByteView bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }
    /// Valid until the next call of another member.
    ByteView view() const { return ByteView(bytes_).subspan(taken_); }
    std::size_t size() const { return bytes_.size() - taken_; }
    bool empty() const { return size() == 0; }
    /// Removes the first `count` bytes; `count` is at most size().
    void take(std::size_t count) {
        taken_ += count;
        if (taken_ < bytes_.size() - taken_) return;
        bytes_.erase(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(taken_));
        taken_ = 0;
    }

  private:
    Bytes bytes_;
    std::size_t taken_ = 0;
};

}  // namespace panelgate
