#include "pcapng.hpp"

namespace panelgate::web {
namespace {

constexpr std::uint32_t kSection = 0x0A0D0D0A;
constexpr std::uint32_t kInterface = 1;
constexpr std::uint32_t kPacket = 6;
constexpr std::uint32_t kByteOrder = 0x1A2B3C4D;

constexpr std::uint16_t kEndOfOptions = 0;
constexpr std::uint16_t kComment = 1;
constexpr std::uint16_t kPacketFlags = 2;
constexpr std::uint16_t kInterfaceName = 2;
constexpr std::uint16_t kApplication = 4;
constexpr std::uint16_t kTimeResolution = 9;
constexpr char kMicroseconds = 6;  ///< 10 to the -6

void put(std::string& text, std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) text += static_cast<char>((value >> (8 * i)) & 0xFF);
}

/// To the next multiple of four.
void pad(std::string& text) { text.append((4 - text.size() % 4) % 4, '\0'); }

void put_option(std::string& body, std::uint16_t code, std::string_view value) {
    put(body, code, 2);
    put(body, value.size(), 2);
    body += value;
    pad(body);
}

/// The length stands at both ends, so that a file can be read backwards.
void put_block(std::string& text, std::uint32_t type, const std::string& body) {
    constexpr std::size_t kAround = 12;
    put(text, type, 4);
    put(text, body.size() + kAround, 4);
    text += body;
    put(text, body.size() + kAround, 4);
}

}  // namespace

Pcapng::Pcapng(std::string_view application, std::string_view interface, std::uint16_t link) {
    std::string section;
    put(section, kByteOrder, 4);
    put(section, 1, 2);  // version 1.0
    put(section, 0, 2);
    put(section, UINT64_MAX, 8);  // its length is not said
    put_option(section, kApplication, application);
    put_option(section, kEndOfOptions, {});
    put_block(text_, kSection, section);

    std::string described;
    put(described, link, 2);
    put(described, 0, 2);
    put(described, 0, 4);  // packets are never cut
    put_option(described, kInterfaceName, interface);
    put_option(described, kTimeResolution, std::string_view(&kMicroseconds, 1));
    put_option(described, kEndOfOptions, {});
    put_block(text_, kInterface, described);
}

void Pcapng::add(const Packet& packet) {
    const auto time = static_cast<std::uint64_t>(packet.time.time_since_epoch().count());
    std::string body;
    put(body, 0, 4);  // the interface
    put(body, time >> 32, 4);
    put(body, time, 4);
    put(body, packet.bytes.size(), 4);
    put(body, packet.bytes.size(), 4);
    body += packet.bytes;
    pad(body);
    std::string flags;
    put(flags, static_cast<std::uint64_t>(packet.way), 4);
    put_option(body, kPacketFlags, flags);
    for (const std::string& comment : packet.comments)
        put_option(body, kComment, std::string_view(comment).substr(0, kLongestComment));
    put_option(body, kEndOfOptions, {});
    put_block(text_, kPacket, body);
}

}  // namespace panelgate::web
