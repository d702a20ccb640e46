#include <sys/stat.h>
#include <algorithm>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/value.hpp>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "audit_text.hpp"
#include "commands.hpp"
#include "panelgate/audit/files.hpp"
#include "panelgate/audit/record.hpp"
#include "panelgate/audit/verify.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/explain/load.hpp"
#include "panelgate/rt/clock.hpp"
#include "place.hpp"

namespace panelgate::commands {

namespace {

using Files = std::vector<std::string>;

/// `what`: "FILE: why".
ExitCode cannot_read(const std::string& what) {
    std::cerr << "panelgate: cannot read " << what << '\n';
    return kNoInput;
}

/// Returns the named files, or all files of the chain that a named file belongs to.
struct Named {
    Files files;
    std::string chain{};              ///< the file that is written; empty: `files` were named
    std::vector<Station> stations{};  ///< of the configuration, if that names the files

    /// The audit's files at this moment. A rotation during reading renames files.
    Files now() const {
        if (chain.empty()) return files;
        Files all = audit::rotated_files(chain);
        all.push_back(chain);
        return all;
    }
};

/// The files that were named, or those of the configuration.
std::optional<Named> named_by(const AuditOptions& options, ExitCode& code) {
    Named named{options.files};
    if (named.files.empty()) {
        explain::Loaded loaded = explain::load_file(options.config);
        code = loaded.code;
        if (!loaded.config) return std::nullopt;
        if (!loaded.config->audit) {
            std::cerr << "panelgate: " << options.config
                      << " has no `audit:`; name the files of an audit\n";
            code = kUsage;
            return std::nullopt;
        }
        named.chain = loaded.config->audit->file;
        for (const config::Line& line : loaded.config->lines)
            for (const config::Station& station : line.stations)
                named.stations.push_back({station.name, line.name, station.id});
    }
    std::error_code unknown;
    for (const std::string& file : named.now()) {
        if (!std::filesystem::is_directory(file, unknown)) continue;
        code = cannot_read(file + ": it is a folder; name the files in it");
        return std::nullopt;
    }
    return named;
}

std::optional<audit::Anchors> anchors_of(const Files& logs, ExitCode& code) {
    audit::Anchors anchors;
    anchors.is_read = !logs.empty();
    for (const std::string& log : logs) {
        const auto take = [&](std::string_view line, bool) {
            audit::collect_anchor(line, anchors);
            return true;
        };
        const std::string why = audit::read_lines(log == "-" ? "/dev/stdin" : log, take);
        if (why.empty()) continue;
        code = cannot_read(log + ": " + why);
        return std::nullopt;
    }
    return anchors;
}

void print_good(const audit::Report& report, std::size_t files, bool has_log) {
    std::cout << "whole: " << report.records << (report.records == 1 ? " record" : " records")
              << " (" << report.first << " to " << report.last.number << ") in " << files
              << (files == 1 ? " file" : " files") << '\n'
              << "last hash " << report.last.hash << '\n';
    if (!report.chain.empty()) std::cout << "chain " << report.chain << '\n';
    if (has_log) {
        std::cout << report.anchored << " of them named by the log\n";
    } else {
        std::cout << "not compared with the log (--log FILE): a chain that was made anew, or cut "
                     "off at its end, is found only there\n";
    }
}

ExitCode print_report(const audit::Report& report, std::size_t files, bool has_log) {
    for (const std::string& remark : report.remarks) std::cout << "note: " << remark << '\n';
    if (report.fault) {
        const audit::Fault& fault = *report.fault;
        std::cout << fault.file;
        if (fault.line > 0) std::cout << ':' << fault.line;
        std::cout << ": " << fault.kind << ": " << fault.text << '\n';
        if (report.records > 0)
            std::cout << report.records << " records before it are right (" << report.first
                      << " to " << report.last.number << ")\n";
        return kNo;
    }
    if (report.records == 0) {
        std::cout << "there is no record\n";
        return kNo;
    }
    print_good(report, files, has_log);
    return kFine;
}

/// What is behind each name.
std::vector<std::pair<std::string, ino_t>> identities(const Files& files) {
    std::vector<std::pair<std::string, ino_t>> all;
    for (const std::string& file : files) {
        struct stat found{};
        all.emplace_back(file, ::stat(file.c_str(), &found) == 0 ? found.st_ino : 0);
    }
    return all;
}

}  // namespace

ExitCode audit_verify(const AuditOptions& options) {
    constexpr int kTries = 20;
    ExitCode code = kFine;
    const auto anchors = anchors_of(options.logs, code);
    if (!anchors) return code;
    const auto named = named_by(options, code);
    if (!named) return code;
    for (int tries = 1;; ++tries) {
        const Files files = named->now();
        const auto before = identities(files);
        const audit::Report report = audit::verify(files, *anchors, named->chain);
        // A rotation meanwhile looks as if records were removed, or added.
        const bool has_rotated = before != identities(named->now());
        const bool is_unread = !report.unread.empty();
        if (has_rotated && (is_unread || report.fault) && tries < kTries) continue;
        if (is_unread) return cannot_read(report.unread);
        return print_report(report, files.size(), !options.logs.empty());
    }
}

namespace {

/// Which station is meant. What only an earlier configuration had is looked for by its name;
/// `doubt`: what to say if nothing is found.
void set_station(AuditFilter& filter, const std::string& typed, const Named& named,
                 std::string& doubt) {
    if (typed.empty()) return;
    FoundStation found = station_of(named.stations, typed);
    if (!found.wrong.empty()) {
        const std::size_t slash = std::min(typed.find_first_of("/:"), typed.size());
        filter.station = typed;
        filter.line = slash < typed.size() ? typed.substr(0, slash) : "";
        filter.id = slash < typed.size() ? typed.substr(slash + 1) : "";
        if (!named.chain.empty()) doubt = std::move(found.wrong);
        return;
    }
    filter.station = found.station.name;
    filter.line = found.station.line;
    filter.id = std::to_string(found.station.id);
}

std::optional<AuditFilter> filter_of(const AuditOptions& options) {
    AuditFilter filter;
    filter.kind = options.kind;
    filter.client = options.client;
    const std::vector<std::string> kinds(audit::kKinds.begin(), audit::kKinds.end());
    if (!filter.kind.empty() && std::ranges::find(kinds, filter.kind) == kinds.end()) {
        std::cerr << "panelgate: audit: there is no kind '" << filter.kind << '\''
                  << suggestion(filter.kind, kinds) << '\n';
        return std::nullopt;
    }
    for (const auto& [typed, option, into] :
         {std::tuple{&options.since, "--since", &filter.since},
          std::tuple{&options.until, "--until", &filter.until}}) {
        if (typed->empty()) continue;
        const auto time = audit_time(*typed, rt::wall_now());
        if (!time) {
            std::cerr << "panelgate: audit: " << option << " is a span such as 30min, 1h or 7d, or "
                      << "a time such as 2026-11-26T08:00:00Z, not '" << *typed << "'\n";
            return std::nullopt;
        }
        *into = *time;
    }
    return filter;
}

bool print_record(std::string_view line, const AuditFilter& filter, bool as_json) {
    boost::system::error_code wrong;
    const boost::json::value value = boost::json::parse(line, wrong);
    const auto* record = wrong ? nullptr : value.if_object();
    if (record == nullptr || !is_shown(*record, filter)) return false;
    std::cout << (as_json ? std::string(line) : audit_line(*record)) << '\n';
    return true;
}

}  // namespace

ExitCode audit_show(const AuditOptions& options) {
    ExitCode code = kFine;
    auto filter = filter_of(options);
    if (!filter) return kUsage;
    const auto named = named_by(options, code);
    if (!named) return code;
    std::string doubt;
    set_station(*filter, options.station, *named, doubt);
    bool any = false;
    Files files = named->now();
    std::ranges::sort(files, {}, audit::first_record);
    for (const std::string& file : files) {
        const std::string why = audit::read_lines(file, [&](std::string_view line, bool) {
            any = print_record(line, *filter, options.json) || any;
            return static_cast<bool>(std::cout);
        });
        // What a rotation drops meanwhile is no longer there to be shown.
        if (!why.empty() && (named->chain.empty() || std::filesystem::exists(file)))
            return cannot_read(file + ": " + why);
    }
    if (!any && !doubt.empty())
        std::cerr << "panelgate: audit: " << doubt << ", and no record names it\n";
    return any ? kFine : kNo;
}

}  // namespace panelgate::commands
