#pragma once

#include <cstdint>
#include <optional>

#include "attempt.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/modbus/crc_order.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/scan/read_request.hpp"
#include "panelgate/scan/result.hpp"
#include "panelgate/scan/settings.hpp"
#include "recogniser.hpp"

namespace panelgate::scan {

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
