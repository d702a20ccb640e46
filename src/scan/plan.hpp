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

/// Keeps a list without repetitions, in the order of first mention.
template <class T>
void append_new(std::vector<T>& list, const T& value) {
    if (std::ranges::find(list, value) == list.end()) list.push_back(value);
}

/// What is worth trying, the most likely first: what most profiles have as their default, the
/// standard's 19200 8E1 (serial line V1.02, 2.5.1), then the usual rates with each parity. Only
/// what the settings allow; never empty.
std::vector<SerialFormat> likely_formats(const profile::Catalogue& profiles,
                                         const Settings& settings);
/// What may be tried besides, for panels that speak ASCII: the usual rates with 7E1, the standard's
/// (V1.02, 2.5.2), then as 8N1 and with the standard's other parities. May be empty.
std::vector<SerialFormat> ascii_formats(const Settings& settings);
/// First and last addresses of the profiles, then the rest upwards.
std::vector<std::uint8_t> likely_stations(const profile::Catalogue& profiles,
                                          const Settings& settings);

/// The panel's manual offers this format. Of ASCII manuals say nothing.
bool offers(const profile::PanelProfile& panel, const SerialFormat& format);
/// The likeliest format that all of these offer: what a remote line is probably set to.
std::optional<SerialFormat> common_format(const profile::Catalogue& profiles,
                                          const std::vector<const profile::PanelProfile*>& panels);

/// A panel that sends and expects the CRC's high byte first could be here: a profile says so. No
/// `format`: a remote line.
bool may_be_high_first(const profile::Catalogue& profiles, std::uint8_t station,
                       const std::optional<SerialFormat>& format);

/// One question while the format is unknown.
struct Cell {
    SerialFormat format;
    std::uint8_t station = 0;
    modbus::CrcOrder crc_order = modbus::CrcOrder::low_first;
    friend bool operator==(const Cell&, const Cell&) = default;
};

/// All formats with all stations, in rounds: a few stations in every format, then more of them. On
/// a line all stations share a format: the first reply ends this.
class SearchPlan {
  public:
    SearchPlan(const std::vector<SerialFormat>& formats, const std::vector<std::uint8_t>& stations);
    /// When nobody has answered at all: the same in other formats.
    void add(const std::vector<SerialFormat>& formats, const std::vector<std::uint8_t>& stations);
    /// When nobody has answered at all: where a panel may be that has the CRC's high byte first.
    void add_high_first(const profile::Catalogue& profiles, const Settings& settings,
                        const std::vector<SerialFormat>& formats,
                        const std::vector<std::uint8_t>& stations);

    std::optional<Cell> next();
    /// The next one is in another format, or there is none.
    bool is_last_of_format() const;
    /// Something damaged answered here: this station in the other parities comes first, then in
    /// the other rates.
    void hint(const Cell& cell);
    Duration cost(const Settings& settings) const;  ///< of what is left

  private:
    std::vector<Cell> cells_;
    std::size_t at_ = 0;
};

}  // namespace panelgate::scan
