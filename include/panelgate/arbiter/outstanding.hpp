#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/pool.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/request.hpp"
#include "panelgate/modbus/rtu_frame.hpp"

namespace panelgate::arbiter {

/// One request whose reply may still come.
struct Asked {
    enum class By : std::uint8_t {
        us,           ///< a request of this gateway to the station
        broadcast,    ///< a request of this gateway to all stations, which no station may answer
                      ///< (T11)
        other_master  ///< a request of another master to the station (T9)
    };
    By by = By::us;
    TimePoint sent{};    ///< last bit out; of another master's request: last byte in
    TimePoint until{};   ///< no reply comes later than this, as far as the late window tells
    unsigned epoch = 0;  ///< number of the connection that carried the request (T8); set by add()
    Bytes pdu{};
    modbus::ByteCount byte_count = modbus::ByteCount::as_asked;  ///< of its reply (T14)
    Duration window{};  ///< of a request in transit, from when it has arrived (T8): see kInTransit

    /// True if this reply PDU may be the reply.
    bool may_be_answered(ByteView reply) const;
};

/// The memory of one line's past, by station: requests whose reply may still come, and the last
/// reply. Two questions are answered here: may this frame be the reply to one of them, and could a
/// reply to one of them be taken for the reply to a new request (T2). A station serves the requests
/// of one connection in order: the reply to a later request closes the earlier ones. Bounded. Pure.
class Outstanding {
  public:
    static constexpr std::size_t kMost = 16;       ///< requests of this gateway, a station
    static constexpr std::size_t kMostOthers = 4;  ///< broadcasts, and other masters' requests
    /// `until` over a transport that may stall (T8), until a later request has been answered.
    static constexpr TimePoint kInTransit = TimePoint::max();

    // May this frame be the reply?

    /// The oldest request of `by` to this station that this reply PDU may answer, or null.
    const Asked* answered_by(TimePoint now, std::uint8_t station, ByteView reply,
                             Asked::By by = Asked::By::us) const;
    /// True if this reply PDU equals the station's last reply, at most `within` before `now`.
    bool is_last_reply(TimePoint now, std::uint8_t station, ByteView reply, Duration within) const;
    /// True if it has function and length of the station's last reply, at most `within` ago.
    bool has_last_form(TimePoint now, std::uint8_t station, ByteView reply, Duration within) const;

    // Could a reply be taken for the reply to a new request?

    /// True if a request of this gateway to the station is outstanding.
    bool any(TimePoint now, std::uint8_t station) const;
    /// Time from which no outstanding reply or exception could be taken for the reply to `request`.
    /// `again`: a retry, for which the reply to its own earlier attempt counts as well.
    /// `earlier_alone`: only of requests that left over an earlier connection and are delivered: a
    /// reply over this connection proves nothing about those.
    TimePoint clear_at(TimePoint now, std::uint8_t station, const modbus::Request& request,
                       bool again = false, bool earlier_alone = false) const;
    /// True if the normal reply to this read differs from each outstanding reply in function or
    /// length: that reply proves that the station has served all earlier requests. `again`: the
    /// very same read does not count, though its reply proves only that the station is there.
    bool is_proof(TimePoint now, std::uint8_t station, const modbus::Request& read,
                  bool again = false) const;
    /// The last outstanding read of the station, or null.
    const Asked* last_read(TimePoint now, std::uint8_t station) const;
    /// Time from which no reply of any station is outstanding; of requests in transit as if their
    /// `window` began now.
    TimePoint all_clear_at(TimePoint now, Duration window) const;
    /// When the first request left that a reply to `pdu`, sent at `sent`, may answer.
    TimePoint sampled(TimePoint now, std::uint8_t station, ByteView pdu, TimePoint sent) const;

    // What happens

    /// The line was opened: what leaves from now on leaves over a new connection.
    void on_opened() { ++epoch_; }
    /// A request has ended without its reply, a broadcast has left, which this station may answer,
    /// or another master's request was heard.
    void add(std::uint8_t station, Asked asked);
    /// A reply to `asked` was accepted. Returns false if an earlier equal request may have been
    /// answered in its place: then the reply to `asked` itself is outstanding from now on.
    bool on_reply(TimePoint now, std::uint8_t station, Asked asked, ByteView reply);
    /// A reply came that is not the open request's. Closes the oldest request that the reply may
    /// answer and, of the same connection, those before; none where requests of two connections
    /// fit, for their order is unknown. `is_open`: the open request fits as well, so that a
    /// request of another connection stays. Returns the oldest; empty: the reply answers none.
    std::optional<Asked> on_late(TimePoint now, std::uint8_t station, ByteView reply, bool is_open);
    /// This is the last reply of the station, whatever it answers.
    void set_last_reply(TimePoint now, std::uint8_t station, ByteView reply);
    /// Another master's request has had its reply.
    void on_other_answered(TimePoint now, std::uint8_t station, ByteView reply);
    /// A request that left at `sent` was answered: the windows of older ones in transit begin.
    void on_delivered(TimePoint now, TimePoint sent);
    /// Requests of other masters are of no interest any more.
    void forget_other_masters();
    void forget(std::uint8_t station);

  private:
    struct Page {
        PoolVector<Asked> asked;  ///< in the order in which they left
        Bytes reply;              ///< the last reply PDU
        TimePoint replied{};
    };
    const Page* find(std::uint8_t station) const;
    Page& page(std::uint8_t station);
    static void close(Page& page, unsigned epoch, TimePoint sent);
    static bool may_be_taken(const Asked& asked, const modbus::Request& request, bool again);

    PoolVector<Page> pages_;  ///< by station
    unsigned epoch_ = 0;
};

/// The reads that a station is known to answer. Pure.
class KnownReads {
  public:
    void on_answered(const modbus::Request& read);
    /// A client wants this read of a station that never answered; perhaps the panel's only read.
    void on_wanted(const modbus::Request& request) {
        if (request.span()) wanted_ = request;
    }
    /// A proof was not answered: if it was no known read, the panel has its own bounds (T14).
    void on_unanswered(const modbus::Request& read) {
        if (any() && read != *shortest_ && read != *longest_) only_known_ = true;
    }
    /// True if the panel may answer none but the reads that it has answered.
    bool only_known() const { return only_known_; }
    bool any() const { return shortest_.has_value(); }
    /// The shortest read that was answered, else the last wanted, else holding register 0.
    modbus::Request probe() const;
    /// The longest read that the station has answered; empty: none.
    const std::optional<modbus::Request>& longest() const { return longest_; }
    /// The longest read, with one item more; empty: none is known, or nothing more is answered.
    std::optional<modbus::Request> longer() const;
    /// Items of the longest read of this table that the station has answered.
    std::uint32_t longest(modbus::Table table) const {
        return items_[static_cast<std::size_t>(table)];
    }

  private:
    std::optional<modbus::Request> shortest_;
    std::optional<modbus::Request> longest_;
    std::optional<modbus::Request> wanted_;
    std::array<std::uint32_t, modbus::kTables.size()> items_{};
    bool only_known_ = false;
};

}  // namespace panelgate::arbiter
