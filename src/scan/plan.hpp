#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "panelgate/base/serial_format.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/scan/settings.hpp"

namespace panelgate::scan {

/// Appends a value unless the list contains it.
template <class T>
void append_new(std::vector<T>& list, const T& value) {
    if (std::ranges::find(list, value) == list.end()) list.push_back(value);
}

/// Returns the formats to try, most likely first: the profiles' most frequent defaults, the
/// standard's 19200 8E1 (serial line V1.02, 2.5.1), then the usual rates with each parity. Only
/// what the settings allow; never empty.
std::vector<SerialFormat> likely_formats(const profile::Catalogue& profiles,
                                         const Settings& settings);
/// Returns further formats for ASCII panels: the usual rates with 7E1, the standard's (V1.02,
/// 2.5.2), then as 8N1 and with the standard's other parities. May be empty.
std::vector<SerialFormat> ascii_formats(const Settings& settings);
/// Returns the profiles' first and last addresses, then the rest ascending.
std::vector<std::uint8_t> likely_stations(const profile::Catalogue& profiles,
                                          const Settings& settings);

/// True if the panel's manual offers this format. Always true for ASCII, which manuals do not
/// cover.
bool offers(const profile::PanelProfile& panel, const SerialFormat& format);
/// Returns the likeliest format that all of these panels offer: probably the remote line's setting.
std::optional<SerialFormat> common_format(const profile::Catalogue& profiles,
                                          const std::vector<const profile::PanelProfile*>& panels);

/// True if a profile describes a panel at this address that sends the CRC's high byte first. No
/// `format`: a remote line.
bool may_be_high_first(const profile::Catalogue& profiles, std::uint8_t station,
                       const std::optional<SerialFormat>& format);

/// One request while the format is unknown.
struct Cell {
    SerialFormat format;
    std::uint8_t station = 0;
    modbus::CrcOrder crc_order = modbus::CrcOrder::low_first;
    friend bool operator==(const Cell&, const Cell&) = default;
};

/// All formats with all stations, in rounds: a few stations in every format, then more. All
/// stations of a line share a format, so the first reply ends this.
class SearchPlan {
  public:
    SearchPlan(const std::vector<SerialFormat>& formats, const std::vector<std::uint8_t>& stations);
    /// Appends other formats, for when no station has answered at all.
    void add(const std::vector<SerialFormat>& formats, const std::vector<std::uint8_t>& stations);
    /// Appends requests with the CRC's high byte first, for when no station has answered at all.
    void add_high_first(const profile::Catalogue& profiles, const Settings& settings,
                        const std::vector<SerialFormat>& formats,
                        const std::vector<std::uint8_t>& stations);

    std::optional<Cell> next();
    /// True if the next request has another format, or there is none.
    bool is_last_of_format() const;
    /// After a damaged answer: tries this station first in the other parities, then in the other
    /// rates.
    void hint(const Cell& cell);
    Duration cost(const Settings& settings) const;  ///< of the remaining requests

  private:
    std::vector<Cell> cells_;
    std::size_t at_ = 0;
};

}  // namespace panelgate::scan
