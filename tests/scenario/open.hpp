#pragma once

#include <algorithm>
#include <array>
#include <string_view>

namespace panelgate::scenario {

/// What the wide world still shows and nobody has mended yet. A run that ends so is counted and
/// told, and does not fail; whatever is not listed here does. Rows only ever leave this list.
struct OpenViolation {
    std::string_view kind;  ///< label of a Kind or an Oddity; "*": any of them
    std::string_view violation;
};

/// Not listed, because nobody can mend it, is what has nothing on the wire to be told by. The
/// checker knows it by what the world knows, and lets nothing else pass:
///   - A good CRC by chance: nobody has said these bytes (Truth::is_chance()).
///   - The first copy of all of a reply, which comes when the very same has just been asked again,
///     or other values are written to the same place: byte for byte the answer of a panel whose
///     values have not changed, or that has done it, in its time. The answer that it displaces
///     comes one late (Checker::on_copy()). From the next copy on the panel is known: to another
///     question it would be asked for once more, and a confirmation be read back.
///   - A reply with more values than were asked for, right count and good CRC: byte for byte the
///     late one to an earlier request of that length, or the answer to the present one
///     (Checker::is_padded(), looks_late()).
///   - A frame that nobody asked for, of the form of the awaited reply, while that is thought
///     about: to this question alone (Checker::on_imitation()). What it leaves over to the next
///     ones comes much sooner than the panel has ever answered, which 24 replies have shown before.
///   - A reply that a later one has overtaken, where it can only be the awaited one for anybody who
///     takes stations to serve in order, and nothing has come that this does not explain: the same
///     bytes in the same order are those of a panel that serves in turn (Order,
///     Checker::on_reply()). So is the one that it has displaced, and that comes one late.
///   - A reply that begins later than any of its panel, where another or it has just been silent,
///     or an earlier one of its form is owed: to wait for it is to wait for all who may have died
///     with that one, to believe it is to believe the one that is owed (Checker::is_overdue()).
///   - An answer that equals its request and comes when nobody waits for it any more, or between
///     bytes that nobody says: it may be our own frame (Checker::may_be_echo()).
///   - A confirmation that may be the answer to a broadcast of the last seconds, of a place that
///     cannot be read (Checker::check_fault()).
///   - A panel that is offline because it was overdue each time, until it has been heard; or whose
///     last answer equals its request; or whose answer to a probe repeats another one, and is held
///     (Checker::on_refused()).
///   - A copy of a reply that nobody has heard whole: it is that reply (Checker::on_copy()).
inline constexpr std::array<OpenViolation, 0> kOpenViolations{};

inline bool is_open(std::string_view kind, std::string_view violation) {
    return std::ranges::any_of(kOpenViolations, [&](const OpenViolation& open) {
        return (open.kind == "*" || open.kind == kind) && violation.starts_with(open.violation);
    });
}

}  // namespace panelgate::scenario
