#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/time.hpp"

namespace panelgate::tap {

/// What one station has said in each place that is read, by request. Shows whether it answers with
/// its last reply, which was to another place, where the true one never follows. Values may also be
/// equal by nature, at one time or always: a reply is a copy only by bytes that had not moved in
/// either place, and by more than one bit. It is known where the place then says again what it had
/// said before. Bounded. Pure.
class Places {
  public:
    /// `memory`: a station that was found out is, for so long.
    explicit Places(Duration memory) : memory_(memory) {}

    struct Reply {
        ByteView request;
        ByteView pdu;
    };
    /// A read has had its reply, which nothing else speaks against. `last`: the station's reply
    /// before that. Returns true if it may be that one once more.
    bool answered(TimePoint now, const Reply& reply, const std::optional<Reply>& last);

  private:
    struct Place {
        Bytes request;
        Bytes said{};                        ///< last, by itself
        Bytes steady{};                      ///< how often each byte was the same then
        Bytes suspect{};                     ///< since then; empty: none
        std::vector<std::size_t> telling{};  ///< its bytes that are the other place's
    };
    static constexpr std::size_t kPlaces = 32;
    static constexpr int kTelling = 2;      ///< bytes: one may be chance
    static constexpr unsigned kSteady = 3;  ///< so often the same before: measured values are not

    const Place* find(ByteView request) const;
    Place& at(ByteView request);
    static void mark(Place& place, const Place* source, ByteView reply);
    static void say(Place& place, ByteView reply);
    void judge(TimePoint now, const Place& place, ByteView reply);
    bool is_known(TimePoint now) const { return found_out_ && now - *found_out_ < memory_; }

    Duration memory_;
    std::vector<Place> places_;  ///< the one that was asked last is the last
    int score_ = 0;              ///< telling bytes of copies, since equal values were seen
    TimePoint scored_{};
    std::optional<TimePoint> found_out_;
};

}  // namespace panelgate::tap
