#pragma once

#include <algorithm>
#include <cstdint>

namespace panelgate::arbiter {

/// What is true of a frame that was heard: a set of the bits below.
using Facts = std::uint32_t;

namespace fact {

constexpr Facts when(bool is_true, Facts what) { return is_true ? what : 0; }

// Of a frame that answers the open request.
inline constexpr Facts answers = 1 << 0;        ///< station, function, length and echoed fields fit
inline constexpr Facts own_echo = 1 << 1;       ///< equals the request, whose echo has not come yet
inline constexpr Facts refuses_older = 1 << 2;  ///< an exception that an older request may have had

// Of any frame.
inline constexpr Facts own_frame = 1 << 3;     ///< equals the frame that was sent last
inline constexpr Facts request = 1 << 4;       ///< begins with a request of another master
inline constexpr Facts damaged = 1 << 5;       ///< is no good frame
inline constexpr Facts other_master = 1 << 6;  ///< may answer another master's request
inline constexpr Facts broadcast = 1 << 7;     ///< may answer a broadcast
inline constexpr Facts copy = 1 << 8;  ///< equals the last reply of the station, soon behind it
inline constexpr Facts outstanding = 1 << 9;  ///< may answer an outstanding request
inline constexpr Facts last_form = 1 << 10;   ///< has the form of the last reply, soon behind it
inline constexpr Facts known = 1 << 11;       ///< its station was asked before

}  // namespace fact

/// What is done with a frame.
enum class Done : std::uint8_t {
    accept,     ///< the frame is the reply to the open request
    contested,  ///< the reply may be another master's: counted as damage, the wait goes on
    echo,       ///< our own frame: counted, the wait goes on
    request,    ///< the line is left to another master
    damaged,    ///< counted
    nobodys,    ///< counted: of another master's panel, or of a station that was never asked
    broadcast,  ///< counted: an answer to a broadcast, which confirms nothing
    copy,       ///< counted: the station rests after its replies for as long as copies take
    late,       ///< the outstanding request that the frame answers is closed
    second,     ///< counted: a second panel may have this address
    wrong,      ///< counted: the station has said something else than the reply
};

/// The first row of which all facts are true decides.
struct JudgeRow {
    Facts all;
    Done done;
};
inline constexpr JudgeRow kJudgeRows[] = {
    {fact::answers | fact::other_master, Done::contested},  // T9
    {fact::answers | fact::own_echo, Done::echo},           // T6
    {fact::answers | fact::refuses_older, Done::late},      // T2, T10
    {fact::answers, Done::accept},                          // T2, T7, T10
    {fact::own_frame, Done::echo},                          // T6
    {fact::request, Done::request},                         // T9
    {fact::damaged, Done::damaged},                         // T3
    {fact::other_master, Done::nobodys},                    // T9
    {fact::copy, Done::copy},                               // T12
    {fact::outstanding, Done::late},                        // T2, T8
    {fact::broadcast, Done::broadcast},                     // T11
    {fact::last_form, Done::second},                        // T13
    {fact::known, Done::wrong},                             // T13
    {0, Done::nobodys},                                     // T5
};

constexpr Done judge(Facts facts) {
    return std::ranges::find_if(
               kJudgeRows, [facts](const JudgeRow& row) { return (facts & row.all) == row.all; })
        ->done;
}

/// True if the frame is a reply of the station that it names, though not the awaited one.
constexpr bool is_reply(Done done) {
    return done == Done::copy || done == Done::late || done == Done::second || done == Done::wrong;
}

}  // namespace panelgate::arbiter
