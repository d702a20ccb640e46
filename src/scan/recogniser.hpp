#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "attempt.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/scan/options.hpp"
#include "panelgate/scan/report.hpp"

namespace panelgate::scan {

/// Determines a station's profile by reads that one profile grants and another refuses: the
/// profiles' identifications, their functions and the ends of their areas. First asks what best
/// divides the remaining profiles, then confirms the rest.
class Recogniser {
  public:
    /// `profiles` outlives it. No `format`: a remote line. Ignores profiles without this address,
    /// format or CRC order.
    Recogniser(const profile::Catalogue& profiles, std::uint8_t station,
               const std::optional<SerialFormat>& format,
               modbus::CrcOrder order = modbus::CrcOrder::low_first);

    /// Returns the PDU to ask next; nullopt if nothing more can be learned. Without side effects.
    /// Only pure reads.
    std::optional<Bytes> next_probe() const;
    /// `reply`: its PDU; nullopt if the station was silent.
    void on_reply(const Bytes& probe, const std::optional<Bytes>& reply);
    /// The probe could not be asked and shows nothing.
    void skip(const Bytes& probe);

    /// Returns the matching profiles, best first. If none but `generic` matches: that, naming the
    /// nearest.
    std::vector<Candidate> candidates() const;

  private:
    enum class Answer : std::uint8_t { granted, no_function, refused };
    struct ProfileMatch {
        const profile::PanelProfile* profile = nullptr;
        bool possible = true;     ///< not excluded by an identification or a function
        bool by_content = false;  ///< identified by data, not by an exception
        unsigned agreed = 0;
        unsigned differed = 0;
        unsigned exact_matches = 0;  ///< answers as expected including the exception code
    };

    static Answer expected(const profile::PanelProfile& profile, const Bytes& probe);
    static std::optional<Answer> classify(const std::optional<Bytes>& reply);
    bool is_viable(const ProfileMatch& match) const;
    std::optional<Bytes> best_split() const;
    std::optional<Bytes> confirmation() const;
    bool is_asked(const Bytes& probe) const;
    void judge(ProfileMatch& match, const Bytes& probe, const std::optional<Bytes>& reply) const;

    std::vector<ProfileMatch> matches_;
    bool generic_ = false;       ///< the catalogue has the profile `generic`
    std::vector<Bytes> probes_;  ///< probes to choose from
    std::vector<Bytes> asked_;
};

/// Returns the first request to every station: one holding register. An exception is an answer,
/// too.
Bytes first_request();

struct Ask {
    ReadRequest request;
    ReplyTimeouts timeouts;
};

/// Examines a station that has answered: repeats one read to see whether one panel answers or two,
/// then recognises the panel.
class Examination {
  public:
    /// `profiles` and `settings` outlive it. No `format`: a remote line.
    Examination(const profile::Catalogue& profiles, const Settings& settings, std::uint8_t station,
                const std::optional<SerialFormat>& format, modbus::CrcOrder order);

    std::uint8_t station() const { return finding_.station; }
    /// Returns nullopt when everything is known.
    std::optional<Ask> next();
    void on_outcome(const Outcome& outcome);
    /// Handles a valid frame of this station that does not answer the last request. Returns false
    /// if it answers no request of this examination.
    bool on_unsolicited(const Frame& frame);
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
    unsigned silent_ = 0;       ///< in a row
    unsigned outstanding_ = 0;  ///< unanswered requests: late replies may follow
    std::optional<bool> refused_;
    std::optional<Bytes> probe_;  ///< nullopt: the first request
    unsigned tries_ = 0;
    Bytes last_;
    Bytes before_last_;
};

}  // namespace panelgate::scan
