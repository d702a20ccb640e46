// What our master hears, and when: the wire's characters behind an adapter's or a network's delays.
// Also who finds requests in what masters say. Pure: time is an argument.
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <optional>

#include "frame.hpp"
#include "wire.hpp"

namespace zoo {

class Ear {
  public:
    // A byte that has come from the wire at `at` and is kept back for `hold` more, with all behind
    // it.
    void hear(Time at, std::uint8_t value, Time hold = 0);

    // An adapter that hands over every `latency`, or 62 bytes; 0: at once.
    void set_latency(Time latency) { latency_ = latency; }

    // Nothing comes before that moment.
    void stop_until(Time at) { stopped_until_ = std::max(stopped_until_, at); }

    Bytes due(Time now);
    std::optional<Time> next() const;
    void clear() { waiting_.clear(); }

  private:
    struct Heard {
        Time at;
        std::uint8_t value;
    };
    Time release_of(std::size_t i) const;

    std::deque<Heard> waiting_;
    Time latency_ = 0;
    Time last_ = 0;
    Time stopped_until_ = 0;
};

// Finds requests by their length; silence of 3.5 characters begins a new one.
class RequestFinder {
  public:
    explicit RequestFinder(Time silence) : silence_(silence) {}

    // The frame that ends with this character, its checksum unjudged.
    std::optional<Bytes> hear(const Character& c);

    // Whether the next character begins a frame.
    bool is_at_start(const Character& c) const {
        return data_.empty() || c.start - last_ > silence_;
    }

  private:
    Time silence_;
    Bytes data_;
    Time last_ = 0;
};

}  // namespace zoo
