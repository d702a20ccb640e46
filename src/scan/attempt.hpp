#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "panelgate/base/bytes.hpp"
#include "panelgate/base/serial_format.hpp"
#include "panelgate/base/time.hpp"
#include "panelgate/modbus/rtu_frame.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/scan/options.hpp"
#include "panelgate/scan/report.hpp"

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

/// A request to a station that has not answered yet.
struct Turn {
    SerialFormat format;
    std::uint8_t station = 0;
    modbus::CrcOrder crc_order = modbus::CrcOrder::low_first;
    Duration timeout{};    ///< from the end of the request to the first byte of its reply
    bool hurried = false;  ///< late replies to such turns are heard during those behind
};

/// Returns the turns while the format is unknown, in rounds: a few stations in every format, then
/// more; then with the CRC's high byte first, then in ASCII. All stations of a line share a format,
/// so the first reply ends the search.
std::deque<Turn> search_turns(const profile::Catalogue& profiles, const Settings& settings);
/// Returns the turns in the format found: a hurried pass, a patient one, and one with the CRC's
/// high byte first. `settings.quick`: only the first. No `known` format: a remote line.
std::deque<Turn> asking_turns(const profile::Catalogue& profiles, const Settings& settings,
                              const SerialFormat& format, const std::optional<SerialFormat>& known);

/// Maximum bytes kept while listening; the rest is dropped.
inline constexpr std::size_t kMaxHeard = 4096;

struct Frame {
    std::uint8_t station = 0;
    Bytes pdu;
    modbus::CrcOrder crc_order = modbus::CrcOrder::low_first;
};

struct Heard {
    std::vector<Frame> frames;
    std::size_t damaged = 0;  ///< bytes outside of frames
};

/// Extracts valid frames, requests and replies, at any position and in either CRC order. Standard
/// functions only: by chance noise forms a frame at less than one of 50 000 positions.
Heard extract_frames(ByteView bytes);

struct ReplyTimeouts {
    Duration start{};   ///< from the end of the request to the first byte of its reply
    Duration settle{};  ///< after a good reply
};

/// Result of one request.
struct Outcome {
    enum class Kind : std::uint8_t { silent, replied, damaged };
    Kind kind = Kind::silent;
    Bytes reply;        ///< PDU
    unsigned more = 0;  ///< further replies to the same request
    bool header_seen =
        false;  ///< the damaged bytes contain address and function: unlikely for noise
    bool with_damage = false;        ///< damaged bytes in addition to a good reply
    std::vector<Frame> unsolicited;  ///< valid frames that do not answer the request
};

/// One request on the wire and everything heard until the next. Removes the adapter's echo of the
/// request.
class Attempt {
  public:
    Attempt(ReadRequest request, const SerialFormat& format, TimePoint sent,
            ReplyTimeouts timeouts);

    const ReadRequest& request() const { return request_; }
    void on_rx(TimePoint now, ByteView bytes);
    /// Returns when to stop waiting, as far as is known now.
    TimePoint ends_at() const;
    Outcome finish() const;

  private:
    ByteView without_echo() const;
    bool contains_header(ByteView bytes) const;

    ReadRequest request_;
    TimePoint start_by_;
    TimePoint latest_;  ///< continuous noise must not delay the scan
    Duration settle_;
    Duration gap_;  ///< silence that ends an incomplete reply
    TimePoint last_rx_{};
    Bytes heard_;
    bool replied_ = false;
    bool header_seen_ = false;  ///< a damaged reply: no other is expected
};

}  // namespace panelgate::scan
