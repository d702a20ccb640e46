#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/pool.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::modbus {

/// How long an RTU reply is, as far as its own first bytes tell.
struct ReplyLength {
    enum class Kind : std::uint8_t {
        known,      ///< `length` bytes, address to CRC
        need_more,  ///< ask again with more bytes
        by_silence  ///< only silence ends this frame (FRM-11)
    };
    Kind kind = Kind::need_more;
    std::size_t length = 0;
};
/// `frame` starts at the address byte. The exception bit is looked at before any byte count
/// (FRM-02).
ReplyLength reply_length(ByteView frame);

/// Bytes that were heard but belong to no accepted reply.
struct Unused {
    enum class Kind : std::uint8_t {
        own,      ///< a good frame of the station that was asked: not this request's answer
        foreign,  ///< a good frame of another station
        damaged,  ///< never became a good frame
    };
    Kind kind = Kind::damaged;
    std::uint8_t station = 0;  ///< of a good frame
    Bytes bytes;
};

/// Finds the reply to one request in what is heard after it. Lives for one attempt. The length
/// comes from the function and the header, the CRC is the judge, and silence only ends waiting:
/// bytes may come in any pieces, and adapters and busy machines put pauses anywhere. Noise before
/// the reply and good frames of other stations are stepped over; a frame is accepted only if
/// station, function, byte count and echoed fields answer the request (FRM-04, P1). Where the line
/// itself tells the ends of frames (an AsciiTranscript), these alone are judged, whole. Work is
/// linear in the bytes heard, memory bounded.
class ReplyFramer {
  public:
    /// Heard bytes that are kept at most; older ones become Unused.
    static constexpr std::size_t kMaxHeard = 1024;

    enum class Ends : std::uint8_t {
        by_length,  ///< or by silence: RTU
        told        ///< on_end() comes behind every frame, and behind what is none
    };
    /// `orders`: of all that may speak. A frame counts only in the order of its own address.
    ReplyFramer(std::uint8_t station, Bytes request_pdu, const CrcOrders& orders = {},
                Ends ends = Ends::by_length);

    /// Takes bytes; gives the reply PDU as soon as its last byte is there.
    std::optional<Bytes> feed(ByteView bytes);
    /// The line has been silent for the end-of-frame time. Gives a reply that only silence could
    /// end (or that stood behind noise that looked like the start of a frame); forgets the rest.
    std::optional<Bytes> on_silence();
    /// What was fed since the last end is one frame, when it is `good`, or none. Gives the reply if
    /// it is that; forgets the rest. For Ends::told.
    std::optional<Bytes> on_end(bool good);

    /// Bytes wait for more, or for the silence that judges them.
    bool has_pending() const { return !heard_.empty(); }
    /// Some of them may be the beginning of the reply.
    bool has_candidate() const { return has_start() || ends_with_address(); }
    /// ... and its length is known, or will be by its own first bytes: a silence inside is only a
    /// hole.
    bool knows_length() const { return has_start() ? open_length_ : ends_with_address(); }
    /// How many bytes have to come at least until what may be the reply tells more: its header, or
    /// all of it. 0: every byte may tell.
    std::size_t missing() const;
    /// The same, if what has begun is no exception: the request tells then how long it is.
    std::size_t missing_as_asked() const;
    /// The reply is there, but it may be a part of another frame that is not whole yet: a silence
    /// of its length tells.
    bool is_inside() const { return inside_; }
    /// Bytes were given up that held the address and function of the reply but no good frame.
    bool was_damaged() const { return damaged_; }
    /// ... and as many of them as the reply has, or nothing tells how many that are: the reply
    /// itself came damaged.
    bool was_damaged_whole() const { return damaged_whole_; }
    /// ... and it was a read's reply by its header, and longer than our own frame that may begin
    /// like it: it can be nothing else.
    bool had_own_header() const { return own_header_; }
    /// All that is pending is one good frame of the station, and it does not answer.
    bool ends_with_other_frame() const;
    /// What was stepped over so far, in the order in which it was heard.
    std::vector<Unused> take_unused();
    /// How many of the parts that take_unused() gives next stand behind the reply.
    std::size_t parts_behind() const { return behind_; }
    /// Gives up what is pending: it has been judged by somebody else.
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
    bool holds_start(ByteView bytes) const;
    bool is_own_reply(ByteView damaged) const;
    void collect_starts();
    void look_at_head();
    std::optional<Bytes> accept(std::size_t start, Bytes pdu);
    void discard(std::size_t count);
    void classify(ByteView bytes);
    void step_over(Unused part);

    std::uint8_t station_;
    Bytes request_;
    CrcOrders orders_;
    Ends ends_;
    std::optional<std::size_t> expected_;  ///< from the request (FRM-04)
    Bytes heard_;
    std::size_t looked_ = 0;          ///< offsets below were tried as a start
    PoolVector<std::size_t> starts_;  ///< offsets with the right address and function
    std::size_t judged_ = 0;          ///< of the starts
    bool open_length_ = false;
    bool inside_ = false;
    bool damaged_ = false;
    bool damaged_whole_ = false;
    bool own_header_ = false;
    std::size_t behind_ = 0;
    std::vector<Unused> unused_;
};

/// One part, as its end told it: `good` says that it is a frame.
Unused told_part(ByteView bytes, std::uint8_t own_station, bool good);

/// Cuts bytes into good frames (any station) and the rest, for counters: linear time.
std::vector<Unused> classify_heard(ByteView bytes, std::uint8_t own_station,
                                   const CrcOrders& orders = {});

}  // namespace panelgate::modbus
