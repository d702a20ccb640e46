// From what a panel would say to what its line hears: its habits, applied.
#pragma once

#include <vector>

#include "habit.hpp"
#include "wire.hpp"

namespace zoo {

// How long it thinks about the request that Habits::next() has counted.
Time think_time(const Habits& habits, Time usual, Dice& dice);

// All that it says for one reply PDU from `start` on, in order. `character`: the length of one.
std::vector<Speech> shape_reply(const Habits& habits, int unit, const Bytes& reply, Time start,
                                Time character, Dice& dice);

// What our master hears of its own request: by index, whether, and how it is damaged.
struct Echo {
    bool is_heard = false;
    std::uint8_t damage = 0;
};
std::vector<Echo> shape_echo(const Habits& habits, std::size_t size);

}  // namespace zoo
