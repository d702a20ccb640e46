#pragma once

#include <cstdint>

#include "panelgate/base/pool.hpp"

namespace panelgate::arbiter {

/// A transaction is one request on the wire. A line counts them, from 1.
using Transaction = std::uint64_t;

/// The transactions that were made for a job, the oldest first: one for each attempt. Nearly all
/// have one, and then nothing is taken from any heap.
class TransactionNumbers {
  public:
    void add(Transaction number) {
        if (last_ != 0) before_.push_back(last_);
        last_ = number;
    }
    /// 0: it was never sent.
    Transaction last() const { return last_; }
    template <class Each>
    void for_each(Each each) const {
        for (const Transaction number : before_) each(number);
        if (last_ != 0) each(last_);
    }

  private:
    Transaction last_ = 0;
    PoolVector<Transaction> before_;
};

}  // namespace panelgate::arbiter
