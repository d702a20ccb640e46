#pragma once

#include <cstddef>

#include "panelgate/base/bytes.hpp"

namespace panelgate {

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
