#include "local_gateway.hpp"

#include <boost/asio/ip/address.hpp>
#include <charconv>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>
#include <system_error>
#include <vector>

namespace panelgate::commands {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kListens = "0A";  // TCP_LISTEN
constexpr std::size_t kInode = 9;            // its column

/// The kernel prints an address as words of 32 bits of the machine's order.
template <class Bytes>
std::string hex_words(const Bytes& bytes) {
    std::ostringstream text;
    text << std::hex << std::uppercase;
    for (std::size_t at = 0; at < bytes.size(); at += 4) {
        std::uint32_t word = 0;
        std::memcpy(&word, bytes.data() + at, sizeof(word));
        text.width(8);
        text.fill('0');
        text << word;
    }
    return text.str();
}

std::string hex_of(const boost::asio::ip::address& of) {
    return of.is_v4() ? hex_words(of.to_v4().to_bytes()) : hex_words(of.to_v6().to_bytes());
}

/// The local addresses, as the kernel prints them, of a socket that is reached at `at`.
std::set<std::string> reached_at(const boost::asio::ip::address& at) {
    std::set<std::string> all{hex_of(at)};
    if (!at.is_loopback()) return all;
    all.insert(std::string(32, '0'));  // [::], which takes IPv4 as well
    if (at.is_v4()) all.insert(std::string(8, '0'));
    return all;
}

std::string content_of(const fs::path& file) {
    std::ifstream in(file);
    return {std::istreambuf_iterator<char>(in), {}};
}

bool holds_one_of(const fs::path& process, const std::set<std::string>& inodes) {
    std::error_code wrong;
    for (fs::directory_iterator it(process / "fd", wrong), end; !wrong && it != end;
         it.increment(wrong)) {
        std::error_code gone;  // closed meanwhile
        const std::string target = fs::read_symlink(it->path(), gone).string();
        if (target.starts_with("socket:[") && target.ends_with(']') &&
            inodes.contains(target.substr(8, target.size() - 9)))
            return true;
    }
    return false;
}

}  // namespace

std::set<std::string> listening_inodes(std::string_view table, const config::Endpoint& endpoint) {
    boost::system::error_code wrong;
    const auto at = boost::asio::ip::make_address(endpoint.address, wrong);
    if (wrong) return {};
    const std::set<std::string> addresses = reached_at(at);
    std::set<std::string> inodes;
    std::istringstream lines{std::string(table)};
    for (std::string line; std::getline(lines, line);) {
        std::istringstream words(line);
        const std::vector<std::string> columns(std::istream_iterator<std::string>(words), {});
        if (columns.size() <= kInode || columns[3] != kListens) continue;
        const std::size_t colon = columns[1].find(':');
        if (colon == std::string::npos) continue;
        unsigned port = 0;
        const char* const begin = columns[1].data() + colon + 1;
        std::from_chars(begin, columns[1].data() + columns[1].size(), port, 16);
        if (port == endpoint.port && addresses.contains(columns[1].substr(0, colon)))
            inodes.insert(columns[kInode]);
    }
    return inodes;
}

std::optional<pid_t> process_at(const config::Endpoint& endpoint, const fs::path& proc) {
    std::set<std::string> inodes = listening_inodes(content_of(proc / "net/tcp"), endpoint);
    inodes.merge(listening_inodes(content_of(proc / "net/tcp6"), endpoint));
    if (inodes.empty()) return std::nullopt;
    std::error_code wrong;
    for (fs::directory_iterator it(proc, wrong), end; !wrong && it != end; it.increment(wrong)) {
        const std::string name = it->path().filename().string();
        pid_t pid = 0;
        const auto [rest, error] = std::from_chars(name.data(), name.data() + name.size(), pid);
        if (error != std::errc{} || rest != name.data() + name.size()) continue;
        if (content_of(it->path() / "comm") == "panelgate\n" && holds_one_of(it->path(), inodes))
            return pid;
    }
    return std::nullopt;
}

}  // namespace panelgate::commands
