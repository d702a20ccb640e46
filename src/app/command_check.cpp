#include <algorithm>
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <cstddef>
#include <iostream>
#include <iterator>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "capacity.hpp"
#include "commands.hpp"
#include "difference.hpp"
#include "inventory.hpp"
#include "load.hpp"
#include "panelgate/base/utf8.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::app {
namespace {

namespace json = boost::json;

void print_text(const std::string& file, const config::Config& config,
                const std::vector<Capacity>& lines) {
    std::cout << file << " is valid: " << config.lines.size() << " line(s), "
              << config.modbus_tcp.size() << " Modbus/TCP listener(s), "
              << (config.http ? "HTTP on " + config.http->name() : "no HTTP") << '\n'
              << inventory_text(config);
    for (const Capacity& line : lines) std::cout << plan_text(line);
}

/// As a person reads them: the file itself first, from top to bottom.
json::array errors_json(const std::string& file, std::vector<yaml::Problem> problems) {
    std::ranges::sort(problems, {}, [&](const yaml::Problem& problem) {
        return std::tuple(problem.file != file, problem.file, problem.mark.line,
                          problem.mark.column, problem.message);
    });
    json::array errors;
    for (const yaml::Problem& problem : problems) {
        json::object error{{"file", problem.file}};
        if (problem.mark.line > 0) {  // else it is of the whole file
            error["line"] = problem.mark.line;
            error["column"] = problem.mark.column;
        }
        error["message"] = problem.message;
        errors.push_back(std::move(error));
    }
    return errors;
}

/// What is said of the lines' loads.
struct Judged {
    std::vector<Capacity> lines;
    std::vector<std::string> errors;
    std::vector<std::string> warnings;
};

Judged judge(const config::Config& config, bool allow_overload) {
    Judged judged{capacities(config), {}, {}};
    for (const Capacity& capacity : judged.lines) {
        std::ranges::copy(capacity.warnings, std::back_inserter(judged.warnings));
        const plan::Verdict verdict = plan::verdict(capacity.plan);
        if (verdict == plan::Verdict::fine) continue;
        const bool error = verdict == plan::Verdict::overload && !allow_overload;
        (error ? judged.errors : judged.warnings).push_back(overload_text(capacity));
    }
    return judged;
}

/// The file that is compared with; none: nothing is.
struct Compared {
    std::string file;
    Loaded loaded;
};

void print_changes(const std::string& file, const config::Config& config,
                   const Compared& compared) {
    const std::vector<Change> changes = differences(*compared.loaded.config, config);
    const std::string way = " from " + compared.file + " to " + file;
    if (changes.empty()) {
        std::cout << "nothing changes" << way << '\n';
        return;
    }
    std::cout << changes.size() << " change(s)" << way << ":\n";
    for (const Change& change : changes) std::cout << "  " << to_string(change) << '\n';
}

/// Of a file with faults `lines` and its like are not there.
void print_json(const std::string& file, const Loaded& loaded, const Judged& judged,
                const Compared& compared) {
    const bool valid = loaded.config && judged.errors.empty() && compared.loaded.code == kFine;
    json::object all{{"valid", valid}};
    json::array warnings;
    if (loaded.config) {
        all = inventory_json(*loaded.config);
        all["valid"] = valid;
        json::array& lines = all["lines"].as_array();
        for (std::size_t i = 0; i < judged.lines.size(); ++i)
            add_plan(lines[i].as_object(), judged.lines[i]);
        for (const std::string& warning : loaded.config->warnings) warnings.emplace_back(warning);
    }
    for (const std::string& warning : judged.warnings) warnings.emplace_back(warning);
    if (loaded.config && compared.loaded.config)
        all["changes"] = to_json(differences(*compared.loaded.config, *loaded.config));
    json::array errors = errors_json(file, loaded.problems);
    for (json::value& error : errors_json(compared.file, compared.loaded.problems))
        errors.push_back(std::move(error));
    for (const std::string& error : judged.errors)
        errors.push_back(json::object{{"file", file}, {"message", error}});
    all["errors"] = std::move(errors);
    all["warnings"] = std::move(warnings);
    std::cout << as_utf8(web::json_text(all)) << '\n';  // the names of files may be any bytes
}

}  // namespace

ExitCode check(const std::string& file, const CheckOptions& options) {
    const Loaded loaded = load_file(file);
    Compared compared{options.before, {}};
    if (!compared.file.empty()) compared.loaded = load_file(compared.file, "--diff");
    Judged judged;
    if (loaded.config) {
        judged = judge(*loaded.config, options.allow_overload);
        if (compared.loaded.config)
            std::ranges::copy(moved_units(*compared.loaded.config, *loaded.config),
                              std::back_inserter(judged.warnings));
        print_warnings(*loaded.config);
        for (const std::string& told : judged.warnings)
            std::cerr << path_of(file) << ": warning: " << told << '\n';
        for (const std::string& told : judged.errors)
            std::cerr << path_of(file) << ": " << told << " (--allow-overload takes it)\n";
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

}  // namespace panelgate::app
