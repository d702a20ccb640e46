// What is odd about a panel, by name: "think-20ms", "tail", "echo-partial-3". With "@5" behind it
// only every fifth reply has it, with "@=1" only the next one.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "frame.hpp"

namespace zoo {

enum class Kind {
    think,            // A ms
    think_random,     // A to B ms
    think_every,      // B ms, every A-th reply C times that
    slow_then_quick,  // C ms for A replies, then B ms
    quick_then_slow,
    holes,      // pauses of A to B ms between the bytes
    usb,        // the adapter hands over A ms after the first byte, or 62 bytes
    stall,      // one reply in A stops for B to C ms
    split,      // as TCP segments: what is heard stops for A to B ms, up to three times in a reply
    pre,        // byte A right before the reply
    post,       // byte A right behind it
    pregap,     // byte A, and B ms later the reply
    tail,       // one to three random bytes A to B ms behind it
    echo_full,  // our master hears itself
    echo_first,
    echo_last,
    echo_cut_last,
    echo_bit_error,  // in every A-th request
    echo_partial,    // the first A bytes
    crc_swapped,
    crc_bad,
    crc_old,
    pad_behind,       // A bytes behind the checksum
    pad_inside,       // A bytes in front of it
    wrong_function,   // everything is refused, and with function A
    refuse,           // everything is refused with exception A
    max_registers,    // reads of more than A are refused with B, or not answered when B is 0
    duplicate,        // the reply comes again A ms later
    twin,             // two with this address, that think A and B ms
    broadcast_reply,  // answers broadcasts
    babble,           // a good frame that nobody asked for, every A ms
    noise,            // random bytes on the line, every A ms or so
    other_master,     // another one asks this panel every A ms, when a reply has just ended
    reboot,           // silent for A s, then text, then fine for B s, and again
    ignore,           // writes to address A are neither executed nor answered
    mute,             // executes, does not answer
    dead,             // does neither
    rate,             // its clock is A % fast; negative: slow
    no_ring,          // what comes while it thinks is lost
};

struct Habit {
    Kind kind{};
    double a = 0;
    double b = 0;
    double c = 0;
    int every = 1;  // which replies have it
    int left = -1;  // how many more; -1: all
    Time since = 0;
};

std::optional<Habit> parse_habit(std::string_view name, Time since);

// All that is odd about one panel.
class Habits {
  public:
    // "think-2ms,tail"; "-": none. False, and nothing changed, when a name is not known.
    bool set(std::string_view names, Time since);

    // Of the request that is served now (counted by next()): null when it has no such habit.
    const Habit* find(Kind kind) const;

    // The habit itself, whichever reply it is meant for.
    const Habit* always(Kind kind) const;

    // Called once for each request that is served, before find().
    void next();

    // Requests served since set().
    int served() const { return served_; }

    // In the silent part of a reboot.
    bool is_rebooting(Time now) const;

  private:
    std::vector<Habit> all_;
    int served_ = 0;
};

}  // namespace zoo
