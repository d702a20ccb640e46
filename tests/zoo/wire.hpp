// The half-duplex wire: characters with a start and an end, from whoever speaks. Who speaks at the
// same time damages both. Pure: time is an argument.
#pragma once

#include <optional>
#include <vector>

#include "frame.hpp"

namespace zoo {

constexpr int kMaster = 0;  // whom we serve; panels are 1 to 247
constexpr int kOtherMaster = 300;
constexpr int kNoise = 301;
constexpr int kTwin = 1000;  // + unit: the second panel with that address

struct Character {
    Time start = 0;
    Time end = 0;
    Time hold = 0;  // how much later than on the wire our master hears it, and all behind it
    int speaker = 0;
    std::uint8_t value = 0;
    bool first = false;  // of what was said in one go
    bool last = false;
    bool damaged = false;
};

// Something said in one go: `start` is the earliest, a speaker finishes what it has begun.
struct Speech {
    Time start = 0;
    int speaker = 0;
    Bytes bytes;
    bool is_reply = false;       // not what comes before or behind it
    double rate = 1.0;           // of the speaker's clock to the nominal one
    std::vector<Time> pauses{};  // on the wire, before the character of that index
    std::vector<Time> holds{};   // in our master's ear
};

class Wire {
  public:
    explicit Wire(Time character, std::uint32_t seed) : character_(character), dice_(seed) {}

    // Returns the end of its last character.
    Time say(const Speech& speech);

    // The next character that has wholly passed; damaged ones have a wrong value.
    std::optional<Character> passed(Time now);

    // When it makes sense to look again: characters come in grains, the last of a speech on time.
    std::optional<Time> next(Time grain_end) const;

    Time character() const { return character_; }
    Time busy_until() const { return busy_until_; }
    void silence() { coming_.clear(); }
    std::uint64_t collisions() const { return collisions_; }

  private:
    Time free_from(Time start, Time duration, int speaker) const;
    bool meets_another(const Character& one) const;

    Time character_;
    Dice dice_;
    std::vector<Character> coming_;  // by their end
    std::vector<Character> gone_;    // those that one still to come may have met
    Time busy_until_ = 0;
    std::uint64_t collisions_ = 0;
};

}  // namespace zoo
