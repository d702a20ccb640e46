#include <fcntl.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <iostream>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "commands.hpp"
#include "panelgate/base/bytes.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/web/http/settings.hpp"
#include "panelgate/yaml/document.hpp"
#include "service_user.hpp"

namespace panelgate::commands {

namespace {

/// 160 bits by the kernel, as hex digits.
std::optional<std::string> random_token() {
    std::array<std::uint8_t, 20> bytes{};
    if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
        return std::nullopt;
    return to_hex(bytes, "");
}

/// "90d" from today on, or a day as it is; nullopt for anything else.
std::optional<std::string> last_day(std::string_view typed) {
    using std::chrono::days;
    constexpr std::array<std::pair<std::string_view, int>, 4> kUnits{
        {{"d", 1}, {"w", 7}, {"months", 30}, {"y", 365}}};
    if (const auto day = web::parse_expiry(typed)) return web::expiry_text(*day);
    int number = 0;
    const auto [end, wrong] = std::from_chars(typed.data(), typed.data() + typed.size(), number);
    const std::string_view unit = typed.substr(static_cast<std::size_t>(end - typed.data()));
    const auto found = std::ranges::find(kUnits, unit, [](const auto& one) { return one.first; });
    constexpr int kMost = 36'500;
    if (wrong != std::errc{} || found == kUnits.end() || number < 1 ||
        number > kMost / found->second)
        return std::nullopt;
    const auto today = std::chrono::floor<days>(rt::wall_now());
    return web::expiry_text(today + days(number * found->second + 1));
}

/// What came of writing a file.
struct Written {
    std::string wrong{};     ///< "" if nothing is
    bool is_shared = false;  ///< the group of the package's service may read it
};

/// Creates the file, for its owner and the service's group, whatever the umask.
Written write_new(const std::string& file, const std::string& text) {
    constexpr mode_t kMode = S_IRUSR | S_IWUSR | S_IRGRP;
    const int handle = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kMode);
    if (handle < 0) return {std::strerror(errno)};
    const ssize_t size = ::write(handle, text.data(), text.size());
    Written written;
    if (size != static_cast<ssize_t>(text.size()))
        written.wrong = size < 0 ? std::strerror(errno) : "the disk is full";
    const auto group = service_group();
    written.is_shared = group && ::fchown(handle, static_cast<uid_t>(-1), *group) == 0 &&
                        ::fchmod(handle, kMode) == 0;
    if (::close(handle) != 0 && written.wrong.empty()) written.wrong = std::strerror(errno);
    if (!written.wrong.empty()) ::unlink(file.c_str());
    return written;
}

ExitCode wrong_usage(const std::string& what) {
    std::cerr << "panelgate: token: " << what << '\n';
    return kUsage;
}

ExitCode not_written(const std::string& file, const std::string& why) {
    if (why == std::strerror(EEXIST))
        return wrong_usage(file + " is there already; give another name");
    std::cerr << "panelgate: cannot write " << file << ": " << why << '\n';
    return kInternal;
}

bool is_name(std::string_view name) {
    return !name.empty() && std::ranges::all_of(name, [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
               c == '-' || c == '_' || c == '.';
    });
}

/// One of the four, or what may be a role of one's own.
bool is_role(std::string_view role) {
    const bool small = std::ranges::none_of(
        role, [](char c) { return (c >= 'A' && c <= 'Z') || c == '_' || c == '.'; });
    return is_name(role) && small && role != "none" && role != "default";
}

/// Who may read the file of a hash, and what to type where the service may not.
std::string readers_of(const std::string& file, bool is_shared) {
    const std::string name = kServiceUser;
    if (is_shared)
        return "Its hash is in " + file + ", which the service's group " + name + " may read\n";
    return "Its hash is in " + file +
           ", which the user of the gateway has to be able to read: sudo " +
           (service_group() ? "chgrp " + name : std::string("chown USER")) + ' ' + file + '\n';
}

void print_token(const TokenOptions& options, const std::string& token, const std::string& hash,
                 const std::string& expires, bool is_shared) {
    const std::string file =
        options.output.empty() ? "/etc/panelgate/tokens/" + options.name : options.output;
    std::cout
        << "The token, which is shown only now; its user sends Authorization: Bearer TOKEN\n\n"
        << "  " << token << "\n\n";
    if (options.output.empty()) {
        std::cout << "Its hash, the one line of a file such as " << file << "\n\n  " << hash
                  << "\n\n";
    } else {
        std::cout << readers_of(file, is_shared);
    }
    std::cout << "In the configuration, below http: tokens:, then `panelgate reload`\n\n  - {name: "
              << yaml::written(options.name) << ", role: " << options.role << ", file: " << file;
    if (!expires.empty()) std::cout << ", expires: " << expires;
    std::cout << "}\n";
}

}  // namespace

ExitCode token_new(const TokenOptions& options) {
    if (!is_name(options.name))
        return wrong_usage("a name has letters, digits, '-', '_' and '.', not '" + options.name +
                           '\'');
    if (!is_role(options.role))
        return wrong_usage("a role is viewer, operator, engineer, admin or one of your own, not '" +
                           options.role + '\'');
    std::string expires;
    if (!options.expires.empty()) {
        const auto day = last_day(options.expires);
        if (!day)
            return wrong_usage(
                "--expires is a span such as 90d, 12w, 6months or 2y, or a day such "
                "as 2027-12-31, not '" +
                options.expires + '\'');
        const auto ends = web::parse_expiry(*day);
        if (ends && *ends <= rt::wall_now())
            return wrong_usage("--expires " + options.expires + " is over already");
        expires = *day;
    }
    const auto token = random_token();
    if (!token) {
        std::cerr << "panelgate: token: the system has no random numbers: " << std::strerror(errno)
                  << '\n';
        return kInternal;
    }
    const std::string hash = web::hash_of(*token);
    Written written;
    if (!options.output.empty()) written = write_new(options.output, hash + '\n');
    if (!written.wrong.empty()) return not_written(options.output, written.wrong);
    print_token(options, *token, hash, expires, written.is_shared);
    return kFine;
}

}  // namespace panelgate::commands
