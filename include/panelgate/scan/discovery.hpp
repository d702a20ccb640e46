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
#include "panelgate/scan/result.hpp"

namespace panelgate::scan {

class Recogniser;

struct DiscoverySettings {
    std::vector<std::uint8_t> stations;  ///< who is asked, in this order; 1..247
    double share = 0.1;                  ///< of the line's time, at most; more than 0, up to 1
    std::optional<SerialFormat> format;  ///< of the line; nothing: the far end's own
};

/// Looks for stations on a line that somebody else drives: says what to ask and when, one question
/// at a time, and learns what became of it. Over any time longer than one question what all of them
/// cost stays below the share: what a question costs more than foreseen is a debt. Each address is
/// asked once; who answers is asked what tells which panel it is; who answered late is asked again.
/// Only pure reads. Pure.
class Discovery {
  public:
    enum class Reply : std::uint8_t {
        answered,  ///< the panel's exceptions, too
        silent,
        damaged,
        unsent,   ///< the line could not take it: it is asked again
        refused,  ///< the line does not ask this address now: it is asked again behind the others
    };
    struct Answer {
        Reply reply = Reply::silent;
        Bytes pdu{};      ///< of Reply::answered
        Duration cost{};  ///< of the line's time
    };

    /// `profiles` outlive it.
    Discovery(const profile::Catalogue& profiles, DiscoverySettings settings, TimePoint now);
    ~Discovery();
    Discovery(const Discovery&) = delete;
    Discovery& operator=(const Discovery&) = delete;

    /// What to ask, once it is time; until on_answer() it is the same.
    std::optional<ReadRequest> question(TimePoint now);
    /// When the next question may go. Not once all is done.
    TimePoint due() const { return due_; }
    void on_answer(TimePoint now, const Answer& answer);

    /// Nobody is left to be asked, or the line has refused too often.
    bool done() const;
    bool gave_up() const { return unsent_ >= kMostUnsent; }
    /// Who has been silent. Whoever was heard meanwhile answers late and may be asked once more.
    const std::set<std::uint8_t>& silent() const { return silent_; }
    void ask_late(std::uint8_t station);

    /// Addresses that were really asked.
    std::size_t asked() const { return asked_; }
    /// Addresses that the line has refused to ask each time, and that were given up.
    std::size_t refused() const { return refused_; }
    /// What is left of the first questions at the pace so far; nothing before any was asked.
    std::optional<Duration> remaining(TimePoint now) const;
    std::size_t of() const { return settings_.stations.size(); }
    /// Who has answered, by address; the one that is looked at, too.
    std::vector<StationFinding> findings() const;

  private:
    static constexpr unsigned kMostUnsent = 60;
    static constexpr unsigned kMostRefused = 5;  ///< of one address
    static constexpr Duration kUnsentPause = 1s;
    static constexpr unsigned kDamagedTries = 3;
    static constexpr unsigned kSilentProbes = 3;  ///< in a row: it has gone again

    void on_first(const Answer& answer);
    void on_probe(const Answer& answer);
    void on_refused(TimePoint now);
    void take_probe();
    void end_examination();
    void pay(TimePoint now, Duration cost);

    const profile::Catalogue& profiles_;
    DiscoverySettings settings_;
    std::deque<std::uint8_t> waiting_;
    std::set<std::uint8_t> silent_;
    std::vector<StationFinding> found_;
    std::unique_ptr<Recogniser> recogniser_;  ///< null: no station is looked at
    StationFinding looked_at_;
    std::optional<Bytes> probe_;
    TimePoint due_;
    TimePoint began_;
    std::size_t asked_ = 0;
    std::size_t refused_ = 0;
    std::map<std::uint8_t, unsigned> refusals_;  ///< of those that still wait
    unsigned unsent_ = 0;                        ///< in a row
    unsigned damaged_ = 0;                       ///< of the question that is asked, in a row
    unsigned silent_probes_ = 0;
};

}  // namespace panelgate::scan
