#include <algorithm>
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <iostream>
#include <iterator>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "commands.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/config/real_files.hpp"
#include "panelgate/explain/capacity.hpp"
#include "panelgate/explain/difference.hpp"
#include "panelgate/explain/inventory.hpp"
#include "panelgate/explain/load.hpp"
#include "panelgate/explain/rights_text.hpp"
#include "panelgate/gateway/certificates.hpp"
#include "panelgate/gateway/prepare.hpp"
#include "panelgate/imports/import.hpp"
#include "panelgate/mbusd/conf.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "service_user.hpp"

namespace panelgate::commands {

namespace {

namespace json = boost::json;

void print_text(const std::string& file, const config::Config& config,
                const std::vector<explain::Capacity>& lines) {
    std::cout << file << " is valid: " << config.lines.size() << " line(s), "
              << config.modbus_tcp.size() << " Modbus/TCP listener(s), "
              << (config.http ? "HTTP on " + config.http->name() : "no HTTP") << '\n'
              << explain::inventory_text(config);
    for (const explain::Capacity& line : lines) std::cout << plan_text(line);
}

/// Sorted for reading: the file itself first, from top to bottom.
json::array errors_json(const std::string& file, std::vector<yaml::Problem> problems) {
    std::ranges::sort(problems, {}, [&](const yaml::Problem& problem) {
        return std::tuple(problem.file != file, problem.file, problem.mark.line,
                          problem.mark.column, problem.message);
    });
    json::array errors;
    for (const yaml::Problem& problem : problems) {
        json::object error{{"file", problem.file}};
        if (problem.mark.line > 0) {  // line 0: the fault is of the whole file
            error["line"] = problem.mark.line;
            error["column"] = problem.mark.column;
        }
        error["message"] = problem.message;
        errors.push_back(std::move(error));
    }
    return errors;
}

/// The verdict on the lines' loads.
struct Judged {
    std::vector<explain::Capacity> lines;
    std::vector<yaml::Problem> errors;
    std::vector<std::string> warnings;
};

Judged judge(const std::string& path, const config::Config& config, bool allow_overload) {
    Judged judged{explain::capacities(config), {}, {}};
    for (const explain::Capacity& capacity : judged.lines) {
        std::ranges::copy(capacity.warnings, std::back_inserter(judged.warnings));
        const plan::Verdict verdict = plan::verdict(capacity.plan);
        if (verdict == plan::Verdict::fine) continue;
        if (verdict == plan::Verdict::overload && !allow_overload) {
            const yaml::Mark mark = config.line_marks.at(capacity.line.name);
            judged.errors.push_back({path, mark, overload_text(capacity)});
        } else {
            judged.warnings.push_back(overload_text(capacity));
        }
    }
    return judged;
}

/// The file to compare with; an empty name: no comparison.
struct Compared {
    std::string file;
    explain::Loaded loaded;
};

void print_changes(const std::string& file, const config::Config& config,
                   const Compared& compared) {
    const std::vector<explain::Change> changes =
        explain::differences(*compared.loaded.config, config);
    const std::string way = " from " + compared.file + " to " + file;
    if (changes.empty()) {
        std::cout << "nothing changes" << way << '\n';
        return;
    }
    std::cout << changes.size() << " change(s)" << way << ":\n";
    for (const explain::Change& change : changes)
        std::cout << "  " << to_string(change)
                  << (change.needs.empty() ? "" : " (" + change.needs + ')') << '\n';
    const std::vector<explain::Interruption> cuts =
        explain::interruptions(*compared.loaded.config, config);
    if (!cuts.empty()) std::cout << "what a reload interrupts:\n";
    for (const explain::Interruption& cut : cuts)
        std::cout << "  " << cut.path << ": " << cut.what << '\n';
}

/// For a file with faults `lines` and the like are missing.
void print_json(const std::string& file, const explain::Loaded& loaded, const Judged& judged,
                const Compared& compared) {
    const bool valid = loaded.config && judged.errors.empty() && compared.loaded.code == kFine;
    json::object all{{"valid", valid}};
    json::array warnings;
    if (loaded.config) {
        all = explain::inventory_json(*loaded.config);
        all["valid"] = valid;
        json::array& lines = all["lines"].as_array();
        for (std::size_t i = 0; i < judged.lines.size(); ++i)
            add_plan(lines[i].as_object(), judged.lines[i]);
        for (const std::string& warning : loaded.config->warnings) warnings.emplace_back(warning);
    }
    for (const std::string& warning : judged.warnings) warnings.emplace_back(warning);
    if (loaded.config && compared.loaded.config) {
        all["changes"] = to_json(explain::differences(*compared.loaded.config, *loaded.config));
        all["interruptions"] =
            to_json(explain::interruptions(*compared.loaded.config, *loaded.config));
    }
    json::array errors = errors_json(file, loaded.problems);
    for (json::value& error : errors_json(compared.file, compared.loaded.problems))
        errors.push_back(std::move(error));
    for (json::value& error : errors_json(file, judged.errors)) errors.push_back(std::move(error));
    all["errors"] = std::move(errors);
    all["warnings"] = std::move(warnings);
    std::cout << as_utf8(web::json_text(all)) << '\n';  // file names may contain any bytes
}

}  // namespace

namespace {

ExitCode print_explanation(const std::string& file, const explain::Loaded& loaded,
                           const std::string& question) {
    if (!loaded.config) return loaded.code;
    const explain::Explanation made =
        explain::explain(*loaded.config, explain::path_of(file), question);
    if (!made.wrong.empty()) {
        std::cerr << "panelgate: --explain: " << made.wrong << '\n';
        return kUsage;
    }
    std::cout << made.text << '\n';
    return made.allowed ? kFine : kDenied;
}

}  // namespace

ExitCode check(const std::string& file, const CheckOptions& options) {
    const explain::Loaded loaded = explain::load_file(file);
    if (!options.explain.empty()) return print_explanation(file, loaded, options.explain);
    Compared compared{options.before, {}};
    if (!compared.file.empty()) compared.loaded = explain::load_file(compared.file, "--diff");
    Judged judged;
    if (loaded.config) {
        judged = judge(explain::path_of(file), *loaded.config, options.allow_overload);
        if (compared.loaded.config)
            std::ranges::copy(explain::moved_units(*compared.loaded.config, *loaded.config),
                              std::back_inserter(judged.warnings));
        std::ranges::copy(explain::open_doors(*loaded.config), std::back_inserter(judged.warnings));
        std::ranges::copy(explain::access_doubts(*loaded.config, rt::wall_now()),
                          std::back_inserter(judged.warnings));
        std::ranges::copy(
            gateway::certificate_doubts(*loaded.config, gateway::seconds_since_1970()),
            std::back_inserter(judged.warnings));
        std::ranges::copy(service_doubts(explain::path_of(file), *loaded.config),
                          std::back_inserter(judged.warnings));
        explain::print_warnings(*loaded.config);
        for (const std::string& message : judged.warnings)
            std::cerr << explain::path_of(file) << ": warning: " << message << '\n';
        for (const yaml::Problem& error : judged.errors)
            std::cerr << yaml::format(error) << " (--allow-overload takes it)\n";
    }
    if (options.json) {
        print_json(file, loaded, judged, compared);
    } else if (loaded.config && compared.loaded.config) {
        print_changes(file, *loaded.config, compared);
    } else if (loaded.config && compared.file.empty()) {
        print_text(file, *loaded.config, judged.lines);
    }
    if (loaded.config && !judged.errors.empty()) return kBadConfig;
    return loaded.code != kFine ? loaded.code : compared.loaded.code;
}

namespace {

/// What another program's file has become.
template <class Imported>
ExitCode hand_over(const std::optional<Imported>& imported, const yaml::Problems& problems,
                   const OutputFile& output) {
    if (!imported) {
        std::cerr << problems.text();
        return kBadConfig;
    }
    if (output.file.empty())
        std::cout << imported->yaml << std::flush;
    else if (!write(output, imported->yaml))
        return cannot_write(output);
    for (const std::string& note : imported->notes) std::cerr << note << '\n';
    return kFine;
}

/// The faults of a configuration that was made of another program's tags.
std::vector<yaml::Problem> faults_of(const std::string& yaml) {
    yaml::Problems problems("");
    config::load(yaml, config::RealFiles(), problems,
                 [](const std::string&) -> std::optional<std::string> { return std::nullopt; });
    return problems.list();
}

}  // namespace

ExitCode import_conf(const std::string& file, const OutputFile& output) {
    if (const ExitCode refused = may_write(output); refused != kFine) return refused;
    const std::string path = explain::path_of(file);
    const auto text = config::RealFiles::read_any(path);
    if (!text) {
        std::cerr << "panelgate: cannot read " << path << ": " << std::strerror(errno) << '\n';
        return kNoInput;
    }
    yaml::Problems problems(path);
    bool is_known = false;
    const auto tags = imports::import_tags(*text, problems, is_known, faults_of);
    if (is_known) return hand_over(tags, problems, output);
    return hand_over(mbusd::import_conf(*text, problems), problems, output);
}

}  // namespace panelgate::commands
