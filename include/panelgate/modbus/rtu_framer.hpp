#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/pool.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::modbus {

/// Length of an RTU reply, as far as its own first bytes determine it.
struct ReplyLength {
    enum class Kind : std::uint8_t {
        known,      ///< `length` bytes, address to CRC
        need_more,  ///< call again with more bytes
        by_silence  ///< only silence ends this frame (FRM-11)
    };
    Kind kind = Kind::need_more;
    std::size_t length = 0;
};
/// `frame` starts at the address byte. The exception bit is checked before any byte count (FRM-02).
ReplyLength reply_length(ByteView frame);

/// Received bytes that belong to no accepted reply.
struct Unused {
    enum class Kind : std::uint8_t {
        own,      ///< a valid frame of the addressed station: not the reply to this request
        foreign,  ///< a valid frame of another station
        damaged,  ///< not a valid frame
    };
    Kind kind = Kind::damaged;
    std::uint8_t station = 0;  ///< of a valid frame; of damage that shows that it is there
    Bytes bytes;
};

/// Finds the reply to one request in the bytes received after it. Lives for one attempt. Function
/// and header give the length, the CRC decides, and silence only ends waiting: bytes may come in
/// any pieces, and adapters and busy machines put pauses anywhere. Noise and valid frames of other
/// stations before the reply are skipped; a frame is accepted only if station, function, byte count
/// and echoed fields match the request (FRM-04, P1). If the line marks the ends of frames
/// (AsciiTranscript), only whole frames are judged. Linear time, bounded memory.
class ReplyFramer {
  public:
    /// Maximum of received bytes kept; older ones become Unused.
    static constexpr std::size_t kMaxHeard = 1024;

    enum class Ends : std::uint8_t {
        by_length,  ///< or by silence: RTU
        told        ///< on_end() follows every frame, valid or not
    };
    /// `orders`: of all stations. A frame is valid only in the order of its own address.
    /// `byte_count`: how that of a reply to 01 to 04 is judged, Request::byte_count().
    ReplyFramer(std::uint8_t station, Bytes request_pdu, const CrcOrders& orders = {},
                Ends ends = Ends::by_length, ByteCount byte_count = ByteCount::as_asked);

    /// Feeds bytes; returns the reply PDU as soon as its last byte is there. What has begun behind
    /// it like another reply stays pending.
    std::optional<Bytes> feed(ByteView bytes);
    /// The line has been silent for the end-of-frame time. Returns a reply that only silence could
    /// end (or that followed noise like the start of a frame); drops the rest.
    std::optional<Bytes> on_silence();
    /// The bytes since the last end are one frame, valid if `good`. Returns the reply if it is one;
    /// drops the rest. For Ends::told.
    std::optional<Bytes> on_end(bool good);
    /// They are the beginning of a frame that breaks off: the reply may begin anew. For Ends::told.
    void on_cut();

    /// True if bytes are pending: more bytes or silence will decide.
    bool has_pending() const { return !heard_.empty(); }
    ByteView pending() const { return heard_; }
    /// True if some of them may be the beginning of the reply.
    bool has_candidate() const { return has_start() || ends_with_address(); }
    /// True if, besides, its first bytes will give its length: silence inside is then only a gap.
    bool knows_length() const { return has_start() ? open_length_ : ends_with_address(); }
    /// Minimum number of bytes still needed before the possible reply can be judged further: its
    /// header, or all of it. 0: every byte may decide.
    std::size_t missing() const;
    /// Like missing(), if what has begun is no exception: then the request determines the length.
    std::size_t missing_as_asked() const;
    /// True if the reply is complete but may be part of a frame that is not: silence decides.
    bool is_inside() const { return inside_; }
    /// True if discarded bytes held the address and function of the reply but no valid frame.
    bool was_damaged() const { return damaged_; }
    /// True if, besides, they were as many as the reply has, or its length is unknown: the reply
    /// itself was damaged.
    bool was_damaged_whole() const { return damaged_whole_; }
    /// True if, besides, they had the header of the reply to our read, and were longer than our own
    /// frame that may begin like it: nothing else is possible.
    bool had_own_header() const { return own_header_; }
    /// True if these damaged bytes end like the reply, without its first one to three bytes: an
    /// adapter that opens its receiver too late loses them. What they were is known, and the CRC
    /// tells.
    bool ends_beheaded(ByteView damaged) const;
    /// True if all pending bytes are one valid frame of the station that does not match.
    bool ends_with_other_frame() const;
    /// Returns what was skipped so far, in the order received.
    std::vector<Unused> take_unused();
    /// Number of parts from the next take_unused() that follow the reply.
    std::size_t parts_behind() const { return behind_; }
    /// Takes the pending bytes unjudged.
    Bytes take_pending();
    /// Discards pending bytes, which the caller has judged.
    void drop_pending() { discard(heard_.size()); }

  private:
    std::optional<Bytes> scan(bool silence);
    std::size_t frame_size(ByteView rest, bool silence) const;
    std::optional<Bytes> judge(std::size_t start, bool silence, bool& open) const;
    std::optional<Bytes> answering(ByteView frame) const;
    bool has_start() const { return judged_ < starts_.size(); }
    void forget_starts();
    bool ends_with_address() const {
        if (ends_ == Ends::told && heard_.size() > 1) return false;
        return !heard_.empty() && heard_.back() == station_;
    }
    enum class Inside : std::uint8_t { no, perhaps, yes };
    Inside inside_other(std::size_t start, std::size_t end) const;
    bool is_start(std::uint8_t address, std::uint8_t function) const;
    std::size_t size_from_start(ByteView bytes) const;
    bool is_own_reply(ByteView damaged) const;
    std::size_t own_beginning(ByteView damaged) const;
    std::optional<std::uint8_t> distinct_count() const;
    void collect_starts();
    void find_start_at_head();
    std::optional<Bytes> accept(std::size_t start, Bytes pdu);
    void discard(std::size_t count);
    void classify(ByteView bytes);
    bool begins_like_reply(ByteView bytes) const;
    Bytes classify_behind(ByteView bytes);
    void step_over(Unused part);

    std::uint8_t station_;
    Bytes request_;
    CrcOrders orders_;
    Ends ends_;
    ByteCount byte_count_;
    std::optional<std::size_t> expected_;  ///< from the request (FRM-04)
    Bytes heard_;
    std::size_t looked_ = 0;          ///< offsets below were tried as a start
    PoolVector<std::size_t> starts_;  ///< offsets with the right address and function
    std::size_t judged_ = 0;          ///< index into starts_
    bool open_length_ = false;
    bool inside_ = false;
    bool damaged_ = false;
    bool damaged_whole_ = false;
    bool own_header_ = false;
    std::size_t behind_ = 0;
    std::vector<Unused> unused_;
};

/// Classifies one frame whose end is known; `good` if it is valid.
Unused classify_frame(ByteView bytes, std::uint8_t own_station, bool good);

/// Splits bytes into valid frames (any station) and the rest, for counters: linear time.
std::vector<Unused> classify_heard(ByteView bytes, std::uint8_t own_station,
                                   const CrcOrders& orders = {});

}  // namespace panelgate::modbus
