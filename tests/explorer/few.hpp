#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

namespace panelgate::explorer {

/// At most N values in a row, without memory of its own: states are copied a lot.
template <class T, std::size_t N>
class Few {
  public:
    T* begin() { return values_.data(); }
    T* end() { return values_.data() + size_; }
    const T* begin() const { return values_.data(); }
    const T* end() const { return values_.data() + size_; }
    std::size_t size() const { return size_; }
    bool empty() const { return size_ == 0; }
    bool full() const { return size_ == N; }
    T& front() { return values_[0]; }
    const T& front() const { return values_[0]; }
    T& back() { return values_[size_ - 1]; }
    /// Not when it is full.
    void push_back(const T& value) { values_[size_++] = value; }
    void pop_front() { erase(begin()); }
    void erase(T* at) {
        std::copy(at + 1, end(), at);
        --size_;
    }
    void clear() { size_ = 0; }

  private:
    std::array<T, N> values_{};
    std::size_t size_ = 0;
};

}  // namespace panelgate::explorer
