#include "panelgate/gateway/configuration_text.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "panelgate/base/sha256.hpp"
#include "panelgate/base/text.hpp"
#include "panelgate/config/real_files.hpp"
#include "panelgate/explain/capacity.hpp"
#include "panelgate/explain/difference.hpp"
#include "panelgate/explain/load.hpp"
#include "panelgate/explain/rights_text.hpp"
#include "panelgate/explain/schema_json.hpp"
#include "panelgate/gateway/journal.hpp"
#include "panelgate/gateway/prepare.hpp"
#include "panelgate/gateway/reloader.hpp"
#include "panelgate/gateway/text_file.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/web/http/json_text.hpp"
#include "panelgate/yaml/insert.hpp"

namespace panelgate::gateway {

namespace json = boost::json;

namespace {

std::string sha256_of(std::string_view text) { return std::string(text_of(Sha256().of(text))); }

json::object problem_json(const std::string& file, const yaml::Problem& problem,
                          std::string_view severity) {
    json::object made{{"line", problem.mark.line},
                      {"column", problem.mark.column},
                      {"severity", severity},
                      {"message", as_utf8(problem.message)}};
    if (problem.file != file) made["file"] = as_utf8(problem.file);
    return made;
}

/// Warnings of the configuration begin with "FILE:LINE:COLUMN: warning: ".
yaml::Problem warning_of(const std::string& file, const std::string& text) {
    constexpr std::string_view kWord = " warning: ";
    std::string_view rest = text;
    std::array<int, 2> place{};
    if (!rest.starts_with(file + ':')) return {file, {0, 0}, text};
    rest.remove_prefix(file.size() + 1);
    for (int& number : place) {
        const std::size_t colon = std::min(rest.find(':'), rest.size());
        const auto read = to_number<int>(rest.substr(0, colon));
        if (!read || colon == rest.size()) return {file, {0, 0}, text};
        number = *read;
        rest.remove_prefix(colon + 1);
    }
    if (rest.starts_with(kWord)) rest.remove_prefix(kWord.size());
    return {file, {place[0], place[1]}, std::string(rest)};
}

/// All that `check` warns of.
std::vector<std::string> warnings_of(config::Config& config, const config::Config& running) {
    std::vector<std::string> all;
    for (const StartMessage& message : prepare(config)) all.push_back(message.text);
    for (const auto& more : {explain::moved_units(running, config), explain::open_doors(config),
                             explain::access_doubts(config, rt::wall_now())})
        all.insert(all.end(), more.begin(), more.end());
    return all;
}

json::object plan_json(const config::Config& config) {
    json::array lines;
    for (const explain::Capacity& capacity : explain::capacities(config)) {
        json::object line{{"name", capacity.line.name}};
        add_plan(line, capacity);
        lines.push_back(std::move(line));
    }
    return json::object{{"lines", std::move(lines)}};
}

json::object judged(const std::string& text, const std::string& file,
                    const config::Config& running) {
    explain::Loaded loaded = explain::read_text(text, file);
    json::array problems;
    json::object made{{"valid", loaded.config.has_value()},
                      {"changes", json::array()},
                      {"interruptions", json::array()},
                      {"plan", json::object()}};
    for (const yaml::Problem& problem : loaded.problems)
        problems.push_back(problem_json(file, problem, "error"));
    if (loaded.config) {
        config::Config& config = *loaded.config;
        for (const std::string& warning : warnings_of(config, running))
            problems.push_back(problem_json(file, warning_of(file, warning), "warning"));
        made["changes"] = to_json(explain::differences(running, config));
        made["interruptions"] = to_json(explain::interruptions(running, config));
        made["plan"] = plan_json(config);
    }
    made["problems"] = std::move(problems);
    return made;
}

yaml::Node node_of(const json::value& value) {
    yaml::Node node;
    if (const json::object* object = value.if_object()) {
        node.kind = yaml::Node::Kind::map;
        for (const auto& [key, one] : *object)
            node.entries.push_back({std::string(key), {}, node_of(one)});
    } else if (const json::array* array = value.if_array()) {
        node.kind = yaml::Node::Kind::sequence;
        for (const json::value& one : *array) node.items.push_back(node_of(one));
    } else if (!value.is_null()) {
        node.kind = yaml::Node::Kind::scalar;
        node.quoted = value.is_string() && !web::exact_digits(value);
        node.scalar = node.quoted ? std::string(value.get_string()) : web::json_text(value);
    }
    return node;
}

web::TextSource::Inserted inserted(const std::string& text, const std::string& into,
                                   const json::object& item) {
    yaml::Problems problems("");
    const auto made = yaml::insert(text, into, node_of(item), problems);
    if (!made) {
        const yaml::Problem& why = problems.list().front();
        const std::string line = "line " + std::to_string(why.mark.line) + ": ";
        return {{}, why.mark.line, (why.mark.line > 0 ? line : "") + why.message};
    }
    return {std::string(text).insert(made->at, made->text), made->line, {}};
}

web::TextSource::File read(const std::string& file) {
    auto text = config::RealFiles::read_any(file);
    if (!text) return {{}, {}, std::strerror(errno)};
    std::string sha256 = sha256_of(*text);
    return {std::move(text), std::move(sha256), why_read_only(file)};
}

}  // namespace

/// One text to be written. Owned by the loop, then by the worker, then by the loop again.
struct ConfigurationText::Job {
    std::string file;
    std::string text;
    std::string expected;
    std::string who;
    Handler handler;
    std::shared_ptr<const config::Config> running;
    std::string before{};  ///< the file's text until then
    web::TextVerdict verdict{};
    bool is_back = false;  ///< the file is as it was before

    web::TextVerdict::State check_and_write();
    void put_back();
};

/// Runs in the worker.
web::TextVerdict::State ConfigurationText::Job::check_and_write() try {
    using State = web::TextVerdict::State;
    File found = read(file);
    verdict.sha256 = found.sha256;
    verdict.why = found.why;
    if (!found.text) return State::not_written;
    if (!found.why.empty()) return State::read_only;
    if (expected != "*" && expected.find('"' + found.sha256 + '"') == std::string::npos)
        return State::stale;
    before = std::move(*found.text);
    json::object made = judged(text, file, *running);
    verdict.problems = std::move(made["problems"].as_array());
    verdict.changes = std::move(made["changes"].as_array());
    if (!made["valid"].as_bool()) return State::invalid;
    verdict.why = replace_file(file, text);
    if (!verdict.why.empty()) return State::not_written;
    verdict.sha256 = sha256_of(text);
    return State::written;
} catch (const std::exception& error) {
    verdict.why = error.what();
    return web::TextVerdict::State::not_written;
}

/// Runs in the worker. What somebody else has written meanwhile stays.
void ConfigurationText::Job::put_back() {
    is_back = read(file).sha256 == verdict.sha256 && replace_file(file, before).empty();
}

ConfigurationText::ConfigurationText(boost::asio::any_io_executor executor, Reloader& reloader,
                                     std::string text)
    : reloader_(reloader), executor_(std::move(executor)) {
    versions_.add(text, "start", rt::wall_now());
    if (!reloader_.no_file().empty()) built_in_ = std::move(text);
    reloader_.on_ran([this](const std::string& ran, const std::string& cause) {
        versions_.add(ran, cause, rt::wall_now());
    });
}

void ConfigurationText::keep_in(Journal& journal) {
    journal.ask_kept(TextVersions::kPrefix, [this, &journal](const Journal::Texts& kept) {
        versions_.restore(kept, [&journal](const std::string& key, const std::string& record) {
            journal.keep(key, record);
        });
    });
}

std::string ConfigurationText::read_only() const { return reloader_.read_only(); }

std::function<web::TextSource::File()> ConfigurationText::reader() const {
    if (const std::string why = reloader_.no_file(); !why.empty())
        return [text = built_in_, why] { return File{text, sha256_of(text), why}; };
    return [file = reloader_.file()] { return read(file); };
}

std::function<json::object(const std::string&)> ConfigurationText::judge() const {
    return [file = reloader_.file(), running = reloader_.running()](const std::string& text) {
        return judged(text, file, *running);
    };
}

std::function<json::object()> ConfigurationText::schema() const { return explain::schema_json; }

std::function<web::TextSource::Inserted(const std::optional<std::string>&, const std::string&,
                                        const json::object&)>
ConfigurationText::inserter() const {
    return [read = reader()](const std::optional<std::string>& text, const std::string& into,
                             const json::object& item) {
        if (text) return inserted(*text, into, item);
        const File file = read();
        return file.text ? inserted(*file.text, into, item) : Inserted{{}, 0, file.why};
    };
}

void ConfigurationText::write(std::string text, std::string expected, std::string who,
                              Handler handler) {
    const auto job =
        std::make_shared<Job>(Job{reloader_.file(), std::move(text), std::move(expected),
                                  std::move(who), std::move(handler), reloader_.running()});
    job->verdict.why = reloader_.barred(false);
    if (!job->verdict.why.empty()) {
        const bool no_file = !reloader_.no_file().empty();
        job->verdict.state =
            no_file ? web::TextVerdict::State::read_only : web::TextVerdict::State::not_written;
        return job->handler(std::move(job->verdict));
    }
    if (!worker_) worker_.emplace(executor_);
    worker_->run([job] { job->verdict.state = job->check_and_write(); },
                 [this, job] { reload(job); });
}

void ConfigurationText::reload(const std::shared_ptr<Job>& job) {
    if (job->verdict.state != web::TextVerdict::State::written)
        return job->handler(std::move(job->verdict));
    reloader_.reload({}, job->who, [this, job](std::shared_ptr<const web::ReloadVerdict> came) {
        const auto outcome = came->outcome;
        job->verdict.reload = std::move(came);
        if (outcome == ReloadOutcome::applied || outcome == ReloadOutcome::unchanged)
            return job->handler(std::move(job->verdict));
        job->verdict.state = web::TextVerdict::State::not_applied;
        job->verdict.why = job->verdict.reload->why;
        worker_->run([job] { job->put_back(); },
                     [this, job] {
                         if (job->is_back) reloader_.taken_back();
                         job->handler(std::move(job->verdict));
                     });
    });
}

}  // namespace panelgate::gateway
