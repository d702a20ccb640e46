#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "attempt.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/scan/result.hpp"
#include "panelgate/scan/settings.hpp"

namespace panelgate::scan {

/// Finds out which profile a station is, by reads that one profile grants and another refuses: what
/// the profiles name as their identification, their functions and the ends of their areas. Asks
/// what tells most of those that are still possible apart, then confirms what is left.
class Recogniser {
  public:
    /// `profiles` outlive it. No `format`: a remote line. Profiles that do not have this address,
    /// this format or this order of the CRC are not considered.
    Recogniser(const profile::Catalogue& profiles, std::uint8_t station,
               const std::optional<SerialFormat>& format,
               modbus::CrcOrder order = modbus::CrcOrder::low_first);

    /// The PDU to ask next; nothing when there is nothing more to learn. May be asked repeatedly.
    /// Only pure reads.
    std::optional<Bytes> next_probe() const;
    /// The reply's PDU; nothing when the station was silent.
    void on_reply(const Bytes& probe, const std::optional<Bytes>& reply);
    /// It could not be asked: tells nothing.
    void skip(const Bytes& probe);

    /// The best first. Where no other profile fits: `generic`, and what comes nearest.
    std::vector<Candidate> candidates() const;

  private:
    enum class Answer : std::uint8_t { granted, no_function, refused };
    struct Suspect {
        const profile::PanelProfile* profile = nullptr;
        bool possible = true;     ///< no identification and no function says otherwise
        bool by_content = false;  ///< identified by data, not by a refusal
        unsigned agreed = 0;
        unsigned differed = 0;
        unsigned to_the_letter = 0;  ///< the exception code was the manual's, too
    };

    static Answer expected(const profile::PanelProfile& profile, const Bytes& probe);
    static std::optional<Answer> told(const std::optional<Bytes>& reply);
    bool is_viable(const Suspect& suspect) const;
    std::optional<Bytes> best_split() const;
    std::optional<Bytes> confirmation() const;
    bool is_asked(const Bytes& probe) const;
    void judge(Suspect& suspect, const Bytes& probe, const std::optional<Bytes>& reply) const;

    std::vector<Suspect> suspects_;
    bool generic_ = false;       ///< there is such a profile
    std::vector<Bytes> probes_;  ///< what there is to ask
    std::vector<Bytes> asked_;
};

/// What every station is asked first: one holding register; an exception is an answer, too.
Bytes first_question();

struct Ask {
    ReadRequest request;
    Patience patience;
};

/// One station that has answered: the same read several times, to see whether one panel answers or
/// two, then what tells which panel it is.
class Examination {
  public:
    /// `profiles` and `settings` outlive it. No `format`: a remote line.
    Examination(const profile::Catalogue& profiles, const Settings& settings, std::uint8_t station,
                const std::optional<SerialFormat>& format, modbus::CrcOrder order);

    std::uint8_t station() const { return finding_.station; }
    /// Nothing when all is known.
    std::optional<Ask> next();
    void on_outcome(const Outcome& outcome);
    /// A good frame of this station that answers something else than what was asked last. False:
    /// nothing that was asked.
    bool on_stray(const Frame& frame);
    StationFinding finding() const;

  private:
    bool repeats() const;
    std::optional<Ask> make_ask(const Bytes& pdu, Duration settle) const;
    void count(const Outcome& outcome);
    void compare(const Bytes& reply);

    const Settings& settings_;
    StationFinding finding_;
    Recogniser recogniser_;
    unsigned checks_ = 0;
    unsigned silent_ = 0;  ///< in a row
    unsigned owed_ = 0;    ///< requests without a reply: one may still come
    std::optional<bool> refused_;
    std::optional<Bytes> probe_;  ///< nothing: the first question
    unsigned tries_ = 0;
    Bytes last_;
    Bytes before_last_;
};

}  // namespace panelgate::scan
