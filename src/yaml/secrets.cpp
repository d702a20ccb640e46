#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <string>
#include <vector>

#include "panelgate/base/text.hpp"
#include "panelgate/yaml/document.hpp"

namespace panelgate::yaml {

namespace {

constexpr std::array<std::string_view, 9> kWords{"password", "passwd", "passphrase", "pass",  "pwd",
                                                 "token",    "secret", "api_key",    "apikey"};
constexpr std::size_t kShortest = 3;  // of what is hidden wherever it stands in a message
constexpr std::string_view kHidden = "***";

/// True if a key may begin behind this.
bool is_before_key(char c) {
    return std::string_view(" \t{[,\"'-_").find(c) != std::string_view::npos;
}

/// What stands behind the word where it is a key, to the end of the line or, in braces, of the
/// value; "" if it is none.
std::string_view value_of(std::string_view line, std::size_t at, std::size_t size) {
    if (at > 0 && !is_before_key(line[at - 1])) return {};
    const std::size_t end = at + size;
    const std::size_t value = std::min(line.find_first_not_of(" \t:=\"'", end), line.size());
    if (value == end) return {};  // a longer word
    const bool in_braces = line.substr(0, at).find('{') != line.npos;
    const std::size_t last = in_braces ? line.find_first_of(",}", value) : line.npos;
    return line.substr(value, std::min(last, line.size()) - value);
}

/// The first secret in a line, "" if it has none.
std::string_view secret_in(std::string_view line) {
    const std::string plain = to_lower(line);
    for (const std::string_view word : kWords) {
        for (std::size_t at = plain.find(word); at != plain.npos; at = plain.find(word, at + 1)) {
            const std::string_view value = value_of(line, at, word.size());
            if (value.size() >= kShortest) return value;
        }
    }
    return {};
}

/// True if the value of a secret's key stands on the next line.
bool awaits_secret(std::string_view line) {
    if (!line.ends_with(':')) return false;
    const std::string plain = to_lower(line.substr(0, line.size() - 1));
    return std::ranges::any_of(kWords,
                               [&](std::string_view word) { return plain.ends_with(word); });
}

/// The parts of a secret, because messages quote parts that YAML makes of a text. Words of our own
/// messages are no parts.
std::vector<std::string> parts_of(std::string_view secret) {
    std::vector<std::string> parts;
    std::string part;
    for (const char c : std::string(secret) + ' ') {
        if (std::string_view(" \t:=\"'{}[],").find(c) == std::string_view::npos) {
            part += c;
            continue;
        }
        const bool is_ours = std::ranges::find(kWords, to_lower(part)) != kWords.end();
        if (part.size() >= kShortest && !is_ours) parts.push_back(part);
        part.clear();
    }
    return parts;
}

void hide(std::string& text, const std::string& part) {
    for (std::size_t at = text.find(part); at != text.npos; at = text.find(part, at))
        text.replace(at, part.size(), kHidden);
}

}  // namespace

void Problems::conceal_secrets(std::string_view text) {
    std::map<int, std::vector<std::string>> secrets;  // parts, by line
    bool awaited = false;
    for (int number = 1; !text.empty(); ++number) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        std::string_view line = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back())) != 0)
            line.remove_suffix(1);
        const std::string_view secret = awaited ? line : secret_in(line);
        if (!line.empty()) awaited = awaits_secret(line);
        if (!secret.empty()) secrets.emplace(number, parts_of(secret));
    }
    for (Problem& problem : list_) {
        if (problem.file != file_) continue;
        // Advice at a neighbouring line may quote it, too.
        const auto last = secrets.upper_bound(problem.mark.line + 1);
        for (auto at = secrets.lower_bound(problem.mark.line - 1); at != last; ++at) {
            for (const std::string& part : at->second) {
                hide(problem.message, part);
                hide(problem.excerpt, part);
            }
        }
    }
}

}  // namespace panelgate::yaml
