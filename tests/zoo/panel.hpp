// What a panel of the zoo holds. Every value tells whose it is and where it stands, so that one
// that answers another request can be seen; what is written can be read back.
#pragma once

#include <cstdint>
#include <unordered_map>

#include "frame.hpp"

namespace zoo {

constexpr int kServedRegister = 0xE000;  // requests answered by this panel so far
constexpr int kAskedRegister = 0xE001;   // requests it has heard
constexpr int kEnd = 0xF000;             // addresses from here on are refused with 02

struct Served {
    std::uint64_t asked = 0, executed = 0, answered = 0, dropped = 0;
};

class Panel {
  public:
    explicit Panel(int unit) : unit_(unit) {}

    // The reply to a request PDU; writes 05 06 15 16 have been executed afterwards.
    Bytes execute(const Bytes& pdu);

    Served& served() { return served_; }
    const Served& served() const { return served_; }

    static bool is_write(int function) {
        return function == 5 || function == 6 || function == 15 || function == 16;
    }

  private:
    std::uint16_t holding(int address) const;
    std::uint16_t input(int address) const;
    bool coil(int address) const;
    bool discrete(int address) const;
    Bytes read_bits(const Bytes& pdu) const;
    Bytes read_registers(const Bytes& pdu) const;
    Bytes write_one(const Bytes& pdu);
    Bytes write_many(const Bytes& pdu);

    int unit_;
    Served served_;
    std::unordered_map<int, std::uint16_t> registers_;  // written ones
    std::unordered_map<int, bool> coils_;
};

}  // namespace zoo
