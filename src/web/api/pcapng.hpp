#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/base/wall_time.hpp"

namespace panelgate::web {

/// A file in the format of Wireshark's captures (draft-ietf-opsawg-pcapng): one section, little
/// endian, with one interface whose times are in microseconds. Pure.
class Pcapng {
  public:
    enum class Way : std::uint8_t { in = 1, out = 2 };  ///< as epb_flags has them
    struct Packet {
        WallTime time{};
        Way way = Way::in;
        std::string bytes;
        std::vector<std::string> comments{};  ///< UTF-8; cut after kLongestComment bytes
    };
    static constexpr std::size_t kLongestComment = 1000;

    /// `link`: what the bytes of its packets are (LINKTYPE_…).
    Pcapng(std::string_view application, std::string_view interface, std::uint16_t link);
    void add(const Packet& packet);
    /// What was written since the last call: pieces of one file.
    std::string take() { return std::exchange(text_, {}); }

  private:
    std::string text_;
};

}  // namespace panelgate::web
