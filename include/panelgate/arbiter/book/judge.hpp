#pragma once

#include <algorithm>
#include <cstdint>
#include <iterator>

namespace panelgate::arbiter {

/// What is true of a frame that was heard, as far as it matters to what is done with it.
using Facts = std::uint32_t;

namespace fact {

constexpr Facts when(bool is_true, Facts what) { return is_true ? what : 0; }

// Of any good frame of a station.
inline constexpr Facts other_master = 1 << 0;  ///< may answer another master's request
inline constexpr Facts repeats = 1 << 1;       ///< may be a recent reply once more

// Of one that answers the open request.
inline constexpr Facts answers = 1 << 2;
inline constexpr Facts refuses_other = 1 << 3;     ///< or refuses another outstanding request
inline constexpr Facts late_echo = 1 << 4;         ///< is the request itself, where those come late
inline constexpr Facts overdue = 1 << 5;           ///< may be to one that has passed, and odd
inline constexpr Facts like_echo = 1 << 6;         ///< equals its request, and came too soon
inline constexpr Facts misnumbered = 1 << 7;       ///< may refuse a request of another function
inline constexpr Facts may_ask = 1 << 8;           ///< asking once more would tell
inline constexpr Facts before_echo = 1 << 9;       ///< our own frame may still come behind it
inline constexpr Facts like_broadcast = 1 << 20;   ///< may be the answer to a broadcast
inline constexpr Facts too_soon = 1 << 19;         ///< by a wide margin sooner than ever
inline constexpr Facts before_end = 1 << 21;       ///< began before the request had left
inline constexpr Facts contradicted = 1 << 22;     ///< another one came that differs
inline constexpr Facts may_be_followed = 1 << 23;  ///< its station sends surplus answers

// Of one that does not.
inline constexpr Facts own_frame = 1 << 10;    ///< is the frame that was sent last
inline constexpr Facts request = 1 << 11;      ///< begins with a request of another master
inline constexpr Facts damaged = 1 << 12;      ///< is no good frame
inline constexpr Facts outstanding = 1 << 13;  ///< may answer an outstanding request
inline constexpr Facts closed = 1 << 14;       ///< ... one that has passed or lapsed
inline constexpr Facts sends_twice = 1 << 15;  ///< its station is known to send duplicates
inline constexpr Facts last_form = 1 << 16;    ///< has the form of the last reply, soon after it
inline constexpr Facts broadcast = 1 << 17;    ///< may answer a broadcast
inline constexpr Facts known = 1 << 18;        ///< its station was asked before
inline constexpr Facts answers_all = 1 << 24;  ///< its station was seen to answer broadcasts

}  // namespace fact

/// What is done with it.
enum class Done : std::uint8_t {
    // It answers the open request.
    accept,        ///< it is the answer
    contested,     ///< the attempt is damaged
    reject,        ///< another request's: the attempt goes on
    keep,          ///< a candidate: the answer if nothing else comes
    hold,          ///< the same, for a short time: another answer contradicts it
    ask_again,     ///< a candidate: the request is sent once more
    suspect_echo,  ///< the same, and a read goes out that has no equal echo
    // It does not.
    echo,
    request,    ///< the line is left to another master
    damaged,    ///< counted
    nobodys,    ///< counted: of another master's panel, or of nobody
    duplicate,  ///< its delay is learned
    late,       ///< closes the request that it answers; lateness is learned
    disorder,   ///< late behind a later one: the station does not serve in order
    second,     ///< a second panel of this address, if it happens twice
    broadcast,  ///< the station answers broadcasts, and its writes wait for that
    unasked,    ///< ends the attempt as wrong
};

/// It is the reply to an earlier request.
constexpr bool is_late(Done done) { return done == Done::late || done == Done::disorder; }
/// It is a reply of the station that it names, though not to the open request.
constexpr bool is_reply(Done done) {
    return is_late(done) || done == Done::duplicate || done == Done::second ||
           done == Done::unasked;
}

/// The table of README, "Outstanding replies": of any frame, what it is and what is done with it.
/// The first row of which all is true decides.
struct JudgeRow {
    Facts all;
    Done done;
};
inline constexpr JudgeRow kJudgeRows[] = {
    {fact::answers | fact::other_master, Done::contested},                  // P1
    {fact::answers | fact::refuses_other, Done::reject},                    // P1
    {fact::answers | fact::late_echo, Done::reject},                        // P1
    {fact::answers | fact::overdue, Done::reject},                          // P1
    {fact::answers | fact::like_echo, Done::suspect_echo},                  // P8
    {fact::answers | fact::like_broadcast, Done::suspect_echo},             // P8
    {fact::answers | fact::misnumbered, Done::ask_again},                   // P1
    {fact::answers | fact::before_end | fact::may_ask, Done::ask_again},    // P1
    {fact::answers | fact::before_end, Done::keep},                         // P1
    {fact::answers | fact::contradicted | fact::may_ask, Done::ask_again},  // P1
    {fact::answers | fact::repeats | fact::may_ask, Done::ask_again},       // P1
    {fact::answers | fact::repeats, Done::keep},                            // P1
    {fact::answers | fact::too_soon | fact::may_ask, Done::ask_again},      // P1
    {fact::answers | fact::before_echo, Done::keep},                        // P8
    {fact::answers | fact::may_be_followed | fact::may_ask, Done::hold},    // P1
    {fact::answers, Done::accept},                                          // P1, P3
    {fact::own_frame, Done::echo},                                          // P8
    {fact::request, Done::request},                                         // P1
    {fact::damaged, Done::damaged},                                         // MST-04
    {fact::other_master, Done::nobodys},                                    // P1
    {fact::broadcast | fact::answers_all, Done::broadcast},                 // P8
    {fact::repeats | fact::sends_twice, Done::duplicate},                   // P1
    {fact::outstanding, Done::late},                                        // P1, P4
    {fact::repeats, Done::duplicate},                                       // P1
    {fact::closed, Done::disorder},                                         // P1
    {fact::broadcast, Done::broadcast},                                     // P8
    {fact::last_form, Done::second},                                        // P1
    {fact::known, Done::unasked},                                           // P3
    {0, Done::nobodys},
};

constexpr Done judge(Facts facts) {
    return std::ranges::find_if(
               kJudgeRows, [facts](const JudgeRow& row) { return (facts & row.all) == row.all; })
        ->done;
}

}  // namespace panelgate::arbiter
