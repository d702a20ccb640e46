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

/// Creates the file; returns what is wrong, "" if nothing is.
std::string write_new(const std::string& file, const std::string& text) {
    constexpr mode_t kMode = S_IRUSR | S_IWUSR | S_IRGRP;
    const int handle = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kMode);
    if (handle < 0) return std::strerror(errno);
    const ssize_t written = ::write(handle, text.data(), text.size());
    std::string wrong;
    if (written != static_cast<ssize_t>(text.size()))
        wrong = written < 0 ? std::strerror(errno) : "the disk is full";
    if (::close(handle) != 0 && wrong.empty()) wrong = std::strerror(errno);
    if (!wrong.empty()) ::unlink(file.c_str());
    return wrong;
}

ExitCode wrong_usage(const std::string& what) {
    std::cerr << "panelgate: token: " << what << '\n';
    return kUsage;
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

void print_token(const TokenOptions& options, const std::string& token, const std::string& hash,
                 const std::string& expires) {
    const std::string file =
        options.output.empty() ? "/etc/panelgate/tokens/" + options.name : options.output;
    std::cout
        << "The token, which is shown only now; its user sends Authorization: Bearer TOKEN\n\n"
        << "  " << token << "\n\n";
    if (options.output.empty()) {
        std::cout << "Its hash, the one line of a file such as " << file << "\n\n  " << hash
                  << "\n\n";
    } else {
        std::cout << "Its hash is in " << file << '\n';
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
    if (!options.output.empty()) {
        const std::string wrong = write_new(options.output, hash + '\n');
        if (wrong == std::strerror(EEXIST))
            return wrong_usage(options.output + " is there already; give another name");
        if (!wrong.empty()) {
            std::cerr << "panelgate: cannot write " << options.output << ": " << wrong << '\n';
            return kInternal;
        }
    }
    print_token(options, *token, hash, expires);
    return kFine;
}

}  // namespace panelgate::commands
