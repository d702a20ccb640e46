#include <algorithm>
#include <cctype>
#include <iostream>
#include <string>
#include <string_view>

#include "commands.hpp"
#include "output.hpp"
#include "panelgate/scan/report.hpp"
#include "starter.hpp"

namespace panelgate::commands {

namespace {

/// `text` as one word of a shell.
std::string shell_word(const std::string& text) {
    const auto is_plain = [](char c) {
        return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
               std::string_view("/._-+,:=@%").find(c) != std::string_view::npos;
    };
    if (!text.empty() && std::ranges::all_of(text, is_plain)) return text;
    std::string word = "'";
    for (const char c : text) word += c == '\'' ? "'\\''" : std::string(1, c);
    return word + '\'';
}

}  // namespace

ExitCode init(const ScanOptions& options, const OutputFile& output) {
    if (const ExitCode refused = may_write(output); refused != kFine) return refused;
    const ScanOutcome outcome = search(options);
    if (!outcome.result) return outcome.code;
    print_advice(options, *outcome.result);
    const bool cut_short = !outcome.cut_short.empty();
    if (!scan::found_any(*outcome.result)) {
        if (cut_short) std::cerr << "panelgate: " << outcome.cut_short << '\n';
        std::cerr << "panelgate: there is nothing to write\n";
        return kUnavailable;
    }
    const std::string text =
        starter_yaml({outcome.device, outcome.profiles_dir, *outcome.result, *outcome.profiles});
    if (output.file.empty())
        std::cout << text << std::flush;
    else if (!write(output, text))
        return cannot_write(output);
    else
        std::cerr << "panelgate: wrote " << output.file << " with "
                  << outcome.result->stations.size() << " station(s); to run it: panelgate run -c "
                  << shell_word(output.file) << '\n';
    if (cut_short)
        std::cerr << "panelgate: incomplete: " << outcome.cut_short << "; what was not reached "
                  << "is missing in it\n";
    return outcome.code;
}

ExitCode scan(const ScanOptions& options) {
    const ScanOutcome outcome = search(options);
    if (!outcome.result) return outcome.code;
    if (options.yaml)
        std::cout << scan::report_yaml(outcome.device, *outcome.result, outcome.profiles_dir);
    else
        std::cout << scan::report_text(options.device, *outcome.result, outcome.cut_short);
    if (options.quick && !options.yaml && scan::found_any(*outcome.result))
        std::cout << '\n'
                  << scan::report_yaml(outcome.device, *outcome.result, outcome.profiles_dir);
    std::cout << std::flush;
    print_advice(options, *outcome.result);
    return outcome.code;
}

}  // namespace panelgate::commands
