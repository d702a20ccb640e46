#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/modbus/crc_order.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/scan/result.hpp"

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

}  // namespace panelgate::scan
