#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/scan/report.hpp"

namespace panelgate::scan {

class Recogniser;

struct DiscoverySettings {
    std::vector<std::uint8_t> stations;  ///< addresses to ask, in this order; 1..247
    double share = 0.1;                  ///< maximum share of the line's time; above 0, at most 1
    std::optional<SerialFormat> format;  ///< of the line; nullopt: set by the far end
};

/// Looks for stations on a line that a bus drives: decides what to ask and when, one question at a
/// time. Over any time longer than one question the total cost stays within the share: a question
/// that costs more than expected delays the next ones. Asks each address once; recognises the panel
/// of each that answers; asks again those that answered late. Only pure reads. Pure.
class Discovery {
  public:
    enum class Reply : std::uint8_t {
        answered,  ///< with a reply or an exception
        silent,
        damaged,
        unsent,   ///< the line could not send it: it is asked again
        refused,  ///< the line refuses this address now: the address is asked again later
    };
    struct Answer {
        Reply reply = Reply::silent;
        Bytes pdu{};      ///< for Reply::answered
        Duration cost{};  ///< time used on the line
    };

    /// `profiles` outlives it.
    Discovery(const profile::Catalogue& profiles, DiscoverySettings settings, TimePoint now);
    ~Discovery();
    Discovery(const Discovery&) = delete;
    Discovery& operator=(const Discovery&) = delete;

    /// Returns the question to ask, once due; the same one until on_answer().
    std::optional<ReadRequest> question(TimePoint now);
    /// Returns when the next question may be sent. Meaningless once done.
    TimePoint due() const { return due_; }
    void on_answer(TimePoint now, const Answer& answer);

    /// True if no question is left, or the line was unable to send too often.
    bool done() const;
    bool gave_up() const { return unsent_ >= kMaxUnsent; }
    /// Addresses that were asked and silent. The caller asks those that were heard meanwhile again
    /// by ask_late().
    const std::set<std::uint8_t>& silent() const { return silent_; }
    /// Asks a silent address again, once.
    void ask_late(std::uint8_t station);

    /// Returns the number of addresses asked.
    std::size_t asked() const { return asked_.size(); }
    /// Addresses whose request was on the wire. What the line refused is not among them.
    const std::set<std::uint8_t>& asked_stations() const { return asked_; }
    /// Returns the number of addresses given up because the line always refused them.
    std::size_t refused() const { return refused_; }
    /// Returns the time left for the first questions at the pace so far; nullopt before the first.
    std::optional<Duration> remaining(TimePoint now) const;
    std::size_t of() const { return settings_.stations.size(); }
    /// Returns the stations found so far, by address, including the one being recognised.
    std::vector<StationFinding> findings() const;

  private:
    static constexpr unsigned kMaxUnsent = 60;
    static constexpr unsigned kMaxRefused = 5;  ///< per address
    static constexpr Duration kUnsentPause = 1s;
    static constexpr unsigned kDamagedTries = 3;
    static constexpr unsigned kSilentProbes = 3;  ///< in a row: the station is gone again

    void on_first(const Answer& answer);
    void on_probe(const Answer& answer);
    void on_refused(TimePoint now);
    void take_probe();
    void end_examination();
    void charge(TimePoint now, Duration cost);

    const profile::Catalogue& profiles_;
    DiscoverySettings settings_;
    std::deque<std::uint8_t> waiting_;
    std::set<std::uint8_t> asked_;
    std::set<std::uint8_t> silent_;  ///< of asked_
    std::set<std::uint8_t> late_;    ///< those asked again
    std::vector<StationFinding> found_;
    std::unique_ptr<Recogniser> recogniser_;  ///< null: no station is being recognised
    StationFinding examined_;
    std::optional<Bytes> probe_;
    TimePoint due_;
    TimePoint began_;
    std::size_t refused_ = 0;
    std::map<std::uint8_t, unsigned> refusals_;  ///< of waiting addresses
    unsigned unsent_ = 0;                        ///< in a row
    unsigned damaged_ = 0;                       ///< of the current question, in a row
    unsigned silent_probes_ = 0;
};

}  // namespace panelgate::scan
