#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace panelgate::config {

/// One configuration and its expected messages.
struct GoldenCase {
    std::string name;
    bool whole = false;  ///< the configuration is its lines alone, without the prelude
    std::string lines;
    std::string expected;
};

/// A file of cases about one topic. Comments and what most of its configurations share (the
/// prelude) stand once, at the top; then each case gives its name, the lines that replace the line
/// <case> of the prelude, `----`, and the expected text:
///
///     ==== NAME [whole]
///     lines
///     ----
///     expected text
///
/// A blank line ends a case. A file without a prelude has whole configurations only.
struct GoldenFile {
    std::string comments;
    std::string prelude;
    std::vector<GoldenCase> cases;

    std::string configuration_of(const GoldenCase& one) const {
        static constexpr std::string_view kPlaceholder = "<case>\n";
        if (one.whole || prelude.empty()) return one.lines;
        std::string text = prelude;
        return text.replace(text.find(kPlaceholder), kPlaceholder.size(), one.lines);
    }
    /// Throws if no case has this name.
    GoldenCase& at(const std::string& name) {
        const auto found = std::ranges::find(cases, name, &GoldenCase::name);
        if (found == cases.end()) throw std::out_of_range("no case " + name);
        return *found;
    }
};

/// Throws if the text does not have this form: all of it must be tested.
inline GoldenFile parse_golden(const std::string& text) {
    static constexpr std::string_view kCase = "==== ";
    static constexpr std::string_view kWhole = " whole";
    GoldenFile file;
    std::string* part = &file.prelude;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) {
        if (line.starts_with(kCase)) {
            const bool whole = line.ends_with(kWhole);
            if (whole) line.resize(line.size() - kWhole.size());
            file.cases.push_back({line.substr(kCase.size()), whole, {}, {}});
            part = &file.cases.back().lines;
        } else if (line == "----" && !file.cases.empty() && part == &file.cases.back().lines) {
            part = &file.cases.back().expected;
        } else if (line.empty()) {
            part = nullptr;
        } else if (part == nullptr) {
            throw std::invalid_argument("a line of no case: " + line);
        } else {
            const bool comment = part == &file.prelude && line.starts_with('#');
            (comment ? file.comments : *part) += line + '\n';
        }
    }
    if (!file.prelude.empty() && file.prelude.find("<case>\n") == std::string::npos)
        throw std::invalid_argument("the prelude has no line <case>");
    return file;
}

inline std::string write_golden(const GoldenFile& file) {
    std::string text = file.comments + file.prelude;
    for (const GoldenCase& one : file.cases) {
        text += "\n==== " + one.name + (one.whole ? " whole\n" : "\n");
        text += one.lines + "----\n" + one.expected;
    }
    return text;
}

inline std::string read_text(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace panelgate::config
