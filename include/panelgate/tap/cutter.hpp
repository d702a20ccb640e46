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

/// The request whose reply the line's master waits for.
struct PendingRequest {
    std::uint8_t station = 0;
    Bytes pdu;
};

/// A good frame, or the damaged bytes between two good frames.
struct Piece {
    enum class Kind : std::uint8_t {
        request,
        answer,  ///< answers the pending request
        reply,   ///< has the form of a reply only, and does not answer the pending request
        damaged
    };
    Kind kind = Kind::damaged;
    bool ambiguous = false;  ///< an answer that may also be a request
    Bytes bytes;             ///< address to CRC
    TimePoint begin;
    TimePoint end;
};

/// Cuts the bytes of both sides of a line into frames. Function and header give the length (of a
/// request, of a reply, and of the answer to the pending request), the CRC decides. No silence is
/// needed between frames, and a silence inside a frame does no harm up to Settings::hole (T4). A
/// possible start that waits for bytes delays the later frames. After damage (T3) a frame needs a
/// sensible content besides a matching CRC. Buffers less than a kilobyte; work is linear in the
/// input.
class Cutter {
  public:
    explicit Cutter(const Settings& settings);

    /// Adds bytes; the last byte was received at `now`.
    void hear(TimePoint now, ByteView bytes);
    /// Returns the next piece. `pending`: the request that waits for its reply, or null. `silence`:
    /// incomplete frames will not continue.
    std::optional<Piece> next(const PendingRequest* pending, bool silence);

    bool empty() const { return heard_.empty(); }
    TimePoint last() const { return last_; }  ///< when the last byte came

  private:
    struct Verdict {
        enum class Kind : std::uint8_t { frame, open, nothing };
        Kind kind = Kind::nothing;
        std::size_t size = 0;
        Piece::Kind what = Piece::Kind::damaged;
        bool ambiguous = false;
    };
    Verdict judge(std::size_t start, const PendingRequest* pending, bool silence) const;
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
    std::vector<TimePoint> times_;  ///< end of each byte, at the latest, by the line's rate
    TimePoint last_{};
    std::size_t looked_ = 0;  ///< no frame begins before this index
    bool aligned_ = true;     ///< a frame or a silence precedes the front: a frame is due
};

}  // namespace panelgate::tap
