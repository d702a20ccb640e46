#include <algorithm>
#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <iostream>
#include <tuple>
#include <vector>

#include "commands.hpp"
#include "inventory.hpp"
#include "load.hpp"
#include "panelgate/base/utf8.hpp"
#include "panelgate/web/http/json_text.hpp"

namespace panelgate::app {
namespace {

namespace json = boost::json;

void print_text(const std::string& file, const config::Config& config) {
    std::cout << file << " is valid: " << config.lines.size() << " line(s), "
              << config.modbus_tcp.size() << " Modbus/TCP listener(s), "
              << (config.http ? "HTTP on " + config.http->name() : "no HTTP") << '\n'
              << inventory_text(config);
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

/// Of a file with faults `lines` and its like are not there.
void print_json(const std::string& file, const Loaded& loaded) {
    json::object all{{"valid", loaded.config.has_value()}};
    json::array warnings;
    if (loaded.config) {
        all = inventory_json(*loaded.config);
        all["valid"] = true;
        for (const std::string& warning : loaded.config->warnings) warnings.emplace_back(warning);
    }
    all["errors"] = errors_json(file, loaded.problems);
    all["warnings"] = std::move(warnings);
    std::cout << as_utf8(web::json_text(all)) << '\n';  // the names of files may be any bytes
}

}  // namespace

ExitCode check(const std::string& file, bool json) {
    const Loaded loaded = load_file(file);
    if (loaded.config) print_warnings(*loaded.config);
    if (json) {
        print_json(file, loaded);
    } else if (loaded.config) {
        print_text(file, *loaded.config);
    }
    return loaded.code;
}

}  // namespace panelgate::app
