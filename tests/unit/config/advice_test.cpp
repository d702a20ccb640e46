#include <gmock/gmock.h>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <regex>
#include <set>
#include <string>

#include "golden_cases.hpp"
#include "memory_files.hpp"
#include "panelgate/config/config.hpp"

namespace panelgate::config::advice_test {
namespace {

/// The first message: where it is, and what it says.
struct Told {
    std::size_t line = 0;
    std::size_t column = 0;
    std::string message;
};

std::optional<Told> first_of(const std::string& text) {
    static const std::regex kForm("panelgate\\.yaml:(\\d+):(\\d+): ([^\n]*)\n[^]*");
    std::smatch found;
    if (!std::regex_match(text, found, kForm)) return std::nullopt;
    return Told{std::stoul(found[1]), std::stoul(found[2]), found[3]};
}

std::optional<Told> told(const std::string& configuration) {
    const MemoryFiles files({});
    yaml::Problems problems("panelgate.yaml");
    const auto config = load(configuration, files, problems,
                             [](const std::string&) { return std::optional<std::string>(); });
    return config ? std::nullopt : first_of(problems.text());
}

/// Types what the message says; `at` is the cursor. Nothing if it does not say what to type.
std::optional<std::string> obeyed(std::string line, std::size_t at, const std::string& message) {
    static const std::regex kBlanks("[^]*(add|take away) (\\d+) blanks?(, or .*)?");
    static const std::regex kKey("[^]*; write '([\\w<]+:.*)'");
    static const std::regex kValue(
        "(?!unknown key)[^]*; write ([^ ']+|\"[^\"]*\"|\\{.*\\}|\\[[^\\]]*\\])(, or '- '.*)?");
    std::smatch found;
    if (std::regex_match(message, found, kBlanks)) {
        const std::size_t count = std::stoul(found[2]);
        return found[1] == "add" ? std::string(count, ' ') + line : line.substr(count);
    }
    if (message.find("one '-' too many") != message.npos) return line.erase(at, 2);
    if (message.find("begins no key; remove it") != message.npos) return line.erase(at, 1);
    if (message.ends_with("in place of the 2 blanks there")) return line.replace(at - 2, 2, "- ");
    if (message.starts_with("a '- ' is missing before")) return line.insert(at, "- ");
    if (std::regex_match(message, found, kKey))
        return line.substr(0, line.find_first_not_of(" -")) + found[1].str();
    if (!std::regex_match(message, found, kValue)) return std::nullopt;
    const bool inside = line.find_first_of("{[") < at;
    const std::size_t end = inside ? line.find_first_of(",}]", at + 1) : line.npos;
    return line.substr(0, at) + found[1].str() + (end == line.npos ? "" : line.substr(end));
}

/// What is accepted as YAML there is refused as a name, or is one of two faults of the file.
const std::set<std::string> kStillWrong{"syntax-at-sign", "syntax-backtick", "syntax-star",
                                        "syntax-ini", "column-second-key-left"};

TEST(Advice, WhatASyntaxErrorSaysToTypeIsAcceptedThere) {
    const auto path = std::filesystem::path(SOURCE_ROOT) / "tests/golden/config/syntax.txt";
    std::size_t tried = 0;
    for (const GoldenCase& one : parse_golden(read_text(path)).cases) {
        const auto fault = first_of(one.expected);
        if (!fault || one.lines.starts_with('{') || kStillWrong.contains(one.name)) continue;
        std::size_t begin = 0;
        for (std::size_t line = 1; line < fault->line; ++line)
            begin = one.lines.find('\n', begin) + 1;
        const std::size_t end = one.lines.find('\n', begin);
        const auto line =
            obeyed(one.lines.substr(begin, end - begin), fault->column - 1, fault->message);
        if (!line) continue;
        ++tried;
        const auto next = told(one.lines.substr(0, begin) + *line + one.lines.substr(end));
        EXPECT_TRUE(!next || next->line > fault->line) << one.name << ": " << fault->message << "\n"
                                                       << *line << "\n"
                                                       << next->message;
    }
    EXPECT_GE(tried, 45U);
}

}  // namespace
}  // namespace panelgate::config::advice_test
