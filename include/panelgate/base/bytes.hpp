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

/// Reads big-endian fields from bytes it does not own. Reading past the end yields 0 and makes the
/// failure stick: ask once, at the end, with finished() or ok().
class Reader {
  public:
    explicit Reader(ByteView bytes) : bytes_(bytes) {}

    std::uint8_t u8();
    std::uint16_t u16();
    /// The next n bytes; empty on failure.
    ByteView take(std::size_t n);

    std::size_t left() const { return bytes_.size() - at_; }
    bool ok() const { return ok_; }
    /// Everything was read, and nothing more than there was.
    bool finished() const { return ok_ && left() == 0; }

  private:
    ByteView bytes_;
    std::size_t at_ = 0;
    bool ok_ = true;
};

/// Appends big-endian fields.
class Writer {
  public:
    /// `expected`: bytes; more are taken, too.
    explicit Writer(std::size_t expected = 16) { bytes_.reserve(expected); }
    Writer& u8(unsigned value);
    Writer& u16(unsigned value);
    Writer& raw(ByteView bytes);
    Bytes take() { return std::move(bytes_); }

  private:
    Bytes bytes_;
};

/// Appends as much of `more` as fits into `limit` bytes in all; the rest is dropped.
void append_up_to(std::size_t limit, Bytes& bytes, ByteView more);

/// "1f 03 00"; an empty separator gives "1f0300".
std::string to_hex(ByteView bytes, std::string_view separator = " ");
/// Pairs of hex digits, blanks between pairs allowed; nothing on anything else.
std::optional<Bytes> from_hex(std::string_view text);

/// Bytes of a stream that were fed and not yet taken. Each is moved a constant number of times.
/// Whoever feeds it bounds it.
class ByteQueue {
  public:
    void feed(ByteView bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }
    /// Valid until the next call of another member.
    ByteView view() const { return ByteView(bytes_).subspan(taken_); }
    std::size_t size() const { return bytes_.size() - taken_; }
    bool empty() const { return size() == 0; }
    /// The first `count` bytes are done with; no more than there are.
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
