#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/rtu_framer.hpp"
#include "panelgate/tap/settings.hpp"

namespace panelgate::tap {

/// What the line's master waits for an answer to.
struct Question {
    std::uint8_t station = 0;
    Bytes pdu;
};

/// A good frame, or damaged bytes between two of them.
struct Piece {
    enum class Kind : std::uint8_t {
        request,
        answer,  ///< answers the question
        reply,   ///< of another form than a request, and not to the question
        damaged
    };
    Kind kind = Kind::damaged;
    bool twofold = false;  ///< an answer that may as well be a request
    Bytes bytes;           ///< address to CRC
    TimePoint begin;
    TimePoint end;
};

/// Cuts what both sides of a line say into frames. The function and the header give the lengths (a
/// request's, a reply's, and that of the answer to the question), the CRC judges; no silence is
/// needed between frames, and one inside does no harm before it is a hole. A start that still waits
/// for bytes holds up the later ones. Behind damage a frame needs more than a CRC that fits: what
/// it asks must make sense. Holds less than a kilobyte; work is linear in what is heard.
class Cutter {
  public:
    explicit Cutter(const Settings& settings);

    /// Bytes that have come by `now`, the last of them just then.
    void hear(TimePoint now, ByteView bytes);
    /// The next piece, while `question` (or none) is open. `silence`: what is open will not go on.
    std::optional<Piece> next(const Question* question, bool silence);

    bool empty() const { return heard_.empty(); }
    TimePoint last() const { return last_; }  ///< byte

  private:
    struct Verdict {
        enum class Kind : std::uint8_t { frame, open, nothing };
        Kind kind = Kind::nothing;
        std::size_t size = 0;
        Piece::Kind what = Piece::Kind::damaged;
        bool twofold = false;
    };
    Verdict judge(std::size_t start, const Question* question, bool silence) const;
    std::size_t size_of(std::size_t start, const modbus::ReplyLength& length, bool silence,
                        bool& open) const;
    std::size_t size_by_gap(bool silence, bool& open) const;
    std::vector<std::size_t> good_ends(std::size_t start) const;
    bool goes_on_well(std::size_t start, bool through_another) const;
    bool is_gap_behind(std::size_t place) const;
    bool is_request(std::size_t start, std::size_t size) const;
    Piece cut(std::size_t size, const Verdict& verdict);

    Duration character_;
    std::size_t damaged_run_;
    Bytes heard_;
    std::vector<TimePoint> times_;  ///< when each of them had come, as the rate has it
    TimePoint last_{};
    std::size_t looked_ = 0;  ///< nothing begins below
    bool aligned_ = true;     ///< a frame begins at the front, if it is one
};

}  // namespace panelgate::tap
