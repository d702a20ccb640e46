#include "habit.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <cstdlib>

namespace zoo {
namespace {

struct Name {
    std::string_view text;
    Kind kind;
    double a, b, c;  // unless the name goes on with numbers
    bool is_hex = false;
};

// A longer name stands before one that it begins with.
constexpr std::array kNames{
    Name{"think-rand", Kind::think_random, 0.1, 400, 0},
    Name{"think", Kind::think, 1, 0, 0},
    Name{"every", Kind::think_every, 5, 200, 3},
    Name{"slow-then-quick", Kind::slow_then_quick, 20, 0.2, 40},
    Name{"quick-then-slow", Kind::quick_then_slow, 20, 0.2, 40},
    Name{"holes", Kind::holes, 0, 18, 0},
    Name{"usb", Kind::usb, 16, 0, 0},
    Name{"stall", Kind::stall, 100, 200, 400},
    Name{"split", Kind::split, 30, 200, 0},
    Name{"pregap", Kind::pregap, 0, 3, 0, true},
    Name{"pre", Kind::pre, 0, 0, 0, true},
    Name{"post", Kind::post, 0xFF, 0, 0, true},
    Name{"tail", Kind::tail, 0.5, 5, 0},
    Name{"echo-full", Kind::echo_full, 0, 0, 0},
    Name{"echo-first", Kind::echo_first, 0, 0, 0},
    Name{"echo-last", Kind::echo_last, 0, 0, 0},
    Name{"echo-cutlast", Kind::echo_cut_last, 0, 0, 0},
    Name{"echo-biterr", Kind::echo_bit_error, 1, 0, 0},
    Name{"echo-partial", Kind::echo_partial, 3, 0, 0},
    Name{"crcswap", Kind::crc_swapped, 0, 0, 0},
    Name{"crcbad", Kind::crc_bad, 0, 0, 0},
    Name{"crcold", Kind::crc_old, 0, 0, 0},
    Name{"padin", Kind::pad_inside, 2, 0, 0},
    Name{"pad", Kind::pad_behind, 2, 0, 0},
    Name{"excfn", Kind::wrong_function, 0x84, 0, 0, true},
    Name{"refuse", Kind::refuse, 2, 0, 0},
    Name{"maxregs", Kind::max_registers, 10, 2, 0},
    Name{"dup", Kind::duplicate, 5, 0, 0},
    Name{"twin", Kind::twin, 1, 30, 0},
    Name{"bcast-reply", Kind::broadcast_reply, 0, 0, 0},
    Name{"babble", Kind::babble, 5000, 0, 0},
    Name{"noise", Kind::noise, 1000, 0, 0},
    Name{"master-other-polite", Kind::other_master, 500, 0, 0},
    Name{"reboot", Kind::reboot, 8, 4, 0},
    Name{"ignore", Kind::ignore, 0, 0, 0},
    Name{"mute", Kind::mute, 0, 0, 0},
    Name{"dead", Kind::dead, 0, 0, 0},
    Name{"rate", Kind::rate, 0, 0, 0},
    Name{"noring", Kind::no_ring, 0, 0, 0},
};

// The numbers behind a name: "-0.1ms", "5-200x3", ":5", "+2". False when something else is there.
bool read_numbers(std::string rest, const Name& name, Habit& habit) {
    std::array<double*, 3> places{&habit.a, &habit.b, &habit.c};
    const char* at = rest.c_str();
    for (double* place : places) {
        if (*at == '\0') return true;
        const bool is_signed = name.kind == Kind::rate;
        if (!is_signed && (*at == '-' || *at == ':' || *at == 'x')) ++at;
        char* end = nullptr;
        *place = name.is_hex && place == places[0] ? static_cast<double>(std::strtol(at, &end, 16))
                                                   : std::strtod(at, &end);
        if (end == at) return false;
        at = end;
        if (at[0] == 'm' && at[1] == 's') at += 2;
    }
    return *at == '\0';
}

// Takes "@5" or "@=1" off.
bool take_choice(std::string_view& name, Habit& habit) {
    const std::size_t at = name.find('@');
    if (at == std::string_view::npos) return true;
    std::string choice(name.substr(at + 1));
    name = name.substr(0, at);
    const bool is_count = !choice.empty() && choice[0] == '=';
    const int number = std::atoi(choice.c_str() + (is_count ? 1 : 0));
    (is_count ? habit.left : habit.every) = number;
    return number > 0;
}

}  // namespace

std::optional<Habit> parse_habit(std::string_view name, Time since) {
    Habit habit;
    habit.since = since;
    if (!take_choice(name, habit)) return std::nullopt;
    for (const Name& known : kNames) {
        if (!name.starts_with(known.text)) continue;
        habit.kind = known.kind;
        habit.a = known.a;
        habit.b = known.b;
        habit.c = known.c;
        if (!read_numbers(std::string(name.substr(known.text.size())), known, habit)) break;
        return habit;
    }
    return std::nullopt;
}

bool Habits::set(std::string_view names, Time since) {
    std::vector<Habit> found;
    while (!names.empty() && names != "-") {
        const std::size_t comma = std::min(names.find(','), names.size());
        const auto habit = parse_habit(names.substr(0, comma), since);
        if (!habit) return false;
        found.push_back(*habit);
        names.remove_prefix(std::min(comma + 1, names.size()));
    }
    all_ = std::move(found);
    served_ = 0;
    return true;
}

const Habit* Habits::always(Kind kind) const {
    const auto found =
        std::find_if(all_.begin(), all_.end(), [=](const Habit& h) { return h.kind == kind; });
    return found == all_.end() ? nullptr : &*found;
}

const Habit* Habits::find(Kind kind) const {
    // Several of one kind may be meant for different replies: "think-1,think-2600@=1".
    for (auto h = all_.rbegin(); h != all_.rend(); ++h) {
        if (h->kind == kind && h->left != 0 && served_ % h->every == 0) return &*h;
    }
    return nullptr;
}

void Habits::next() {
    // One that is for the next n replies ends behind them: -1 is for all, 0 is over.
    for (Habit& h : all_) {
        if (served_ > 0 && h.left > 0) --h.left;
    }
    ++served_;
}

bool Habits::is_rebooting(Time now) const {
    const Habit* reboot = always(Kind::reboot);
    if (reboot == nullptr) return false;
    const Time silent = milliseconds(1000 * reboot->a);
    return (now - reboot->since) % (silent + milliseconds(1000 * reboot->b)) < silent;
}

}  // namespace zoo
