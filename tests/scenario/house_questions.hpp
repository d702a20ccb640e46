#pragma once

#include "panelgate/base/bytes.hpp"
#include "random.hpp"
#include "truth.hpp"

namespace panelgate::scenario {

/// What is asked in a house, whoever asks.
class Questions {
  public:
    explicit Questions(Random& random) : random_(random) {}

    /// Few addresses, so that reads are equal, contained and adjacent often.
    Bytes read() {
        if (random_.chance(0.2))
            return Writer().u8(3).u16(kMemory + random_.below(kBusyCells)).u16(2).take();
        const unsigned function = random_.chance(0.8) ? 3 : 4;
        const unsigned count = random_.chance(0.5) ? 4 : random_.between(1, 10);
        return Writer().u8(function).u16(10 * random_.below(12)).u16(count).take();
    }
    /// Every write is another one, so that one that comes twice is seen.
    Bytes write() {
        const unsigned id = ++last_write_ & 0xFFFF;
        const unsigned cell = kMemory + random_.below(kBusyCells);
        if (random_.chance(0.4)) return Writer().u8(5).u16(id).u16(0xFF00).take();
        if (random_.chance(0.5)) return Writer().u8(6).u16(cell).u16(id).take();
        return Writer().u8(16).u16(cell).u16(2).u8(4).u16(id).u16(~id & 0xFFFF).take();
    }

  private:
    static constexpr unsigned kBusyCells = 16;
    Random& random_;
    unsigned last_write_ = 0;
};

}  // namespace panelgate::scenario
