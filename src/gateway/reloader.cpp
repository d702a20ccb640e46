#include "panelgate/gateway/reloader.hpp"

#include <malloc.h>
#include <sys/stat.h>
#include <algorithm>
#include <atomic>
#include <ranges>
#include <utility>

#include "panelgate/config/describe.hpp"
#include "panelgate/explain/difference.hpp"
#include "panelgate/explain/load.hpp"
#include "panelgate/gateway/certificates.hpp"
#include "panelgate/gateway/gateway.hpp"
#include "panelgate/gateway/prepare.hpp"
#include "panelgate/gateway/servers.hpp"
#include "panelgate/gateway/text_file.hpp"
#include "panelgate/rt/log.hpp"

namespace panelgate::gateway {

namespace {

using Stamp = std::optional<std::tuple<std::uint64_t, std::uint64_t, std::int64_t, std::int64_t>>;

Stamp stamp_of(const std::string& path) {
    struct stat facts{};
    if (::stat(path.c_str(), &facts) != 0) return std::nullopt;
    const std::int64_t changed = facts.st_mtim.tv_sec * 1'000'000'000 + facts.st_mtim.tv_nsec;
    return std::tuple(std::uint64_t{facts.st_dev}, std::uint64_t{facts.st_ino},
                      std::int64_t{facts.st_size}, changed);
}

}  // namespace

FileWatch::FileWatch(boost::asio::any_io_executor executor, rt::Clock& clock,
                     std::function<std::vector<std::string>()> files, std::function<void()> changed)
    : files_(std::move(files)),
      changed_(std::move(changed)),
      clock_(clock),
      alarm_(clock.make_alarm()),
      known_(stamps_of(files_())),
      seen_(known_),
      worker_(std::move(executor)) {
    later();
}

FileWatch::Stamps FileWatch::stamps_of(const std::vector<std::string>& paths) {
    Stamps stamps;
    for (const std::string& path : paths) stamps.emplace(path, stamp_of(path));
    return stamps;
}

void FileWatch::later() {
    alarm_->arm(clock_.now() + kEvery, [this] { look(); });
}

void FileWatch::look() {
    auto stamps = std::make_shared<Stamps>();
    worker_.run([stamps, paths = files_()] { *stamps = stamps_of(paths); },
                [this, stamps, alive = std::weak_ptr(alive_)] {
                    if (!alive.expired()) judge(*stamps);
                });
}

void FileWatch::judge(const Stamps& seen) {
    const bool rests = seen == std::exchange(seen_, seen);
    const bool all_there =
        std::ranges::all_of(seen, [](const auto& one) { return one.second.has_value(); });
    if (rests && all_there) {
        const bool changed = std::ranges::any_of(seen, [this](const auto& one) {
            const auto before = known_.find(one.first);
            return before == known_.end() || before->second != one.second;
        });
        known_ = seen;
        if (changed) changed_();
    }
    later();
}

namespace {

using rt::LogLevel;

constexpr const char* kStopping = "the gateway is stopping";
constexpr std::size_t kLogged = 100;   ///< of each list; the verdict has all of them
constexpr std::size_t kWaiting = 256;  ///< requests that may wait for a reload

double unix_now() {
    return std::chrono::duration<double>(rt::wall_now().time_since_epoch()).count();
}

web::ReloadVerdict::Fault fault_of(const yaml::Problem& problem) {
    return {problem.file, problem.mark.line, problem.mark.column, problem.message};
}

void log_verdict(const web::ReloadVerdict& verdict) {
    const std::string outcome(label(verdict.outcome));
    for (const web::ReloadVerdict::Fault& fault : verdict.faults) {
        rt::log(LogLevel::error, "configuration",
                {{"error", yaml::format({fault.file, {fault.line, fault.column}, fault.text})}});
    }
    for (const std::string& change : verdict.changes | std::views::take(kLogged))
        rt::log(LogLevel::info, "configuration changed", {{"change", change}});
    for (const std::string& warning : verdict.warnings | std::views::take(kLogged))
        rt::log(LogLevel::warn, "configuration", {{"warning", warning}});
    for (const std::string& weaker : verdict.weaker | std::views::take(kLogged))
        rt::log(LogLevel::warn, "configuration weaker", {{"what", weaker}});
    for (const std::string& later : verdict.later)
        rt::log(LogLevel::warn, "restart needed", {{"for", later}});
    const bool good =
        verdict.outcome == ReloadOutcome::applied || verdict.outcome == ReloadOutcome::unchanged;
    rt::log(good ? LogLevel::info : LogLevel::error, "reload",
            {{"outcome", outcome},
             {"cause", verdict.cause},
             {"rollback", verdict.rollback ? "true" : "false"},
             {"changes", std::to_string(verdict.changes.size())},
             {"why", verdict.why}});
}

/// The configuration without the lines that are equal in the other one: in a large plant most are,
/// and listing all their settings takes more memory than they do.
config::Config but_equal_lines(const config::Config& config, const config::Config& other) {
    config::Config made = config;
    std::erase_if(made.lines, [&](const config::Line& line) {
        return std::ranges::find(other.lines, line) != other.lines.end();
    });
    return made;
}

}  // namespace

/// One reload. Owned by the loop, then by the worker, then by the loop again.
struct Reloader::Job {
    std::string file;
    std::shared_ptr<const config::Config> running;
    std::shared_ptr<const config::Config> rollback;  ///< null: read the file
    bool may_be_weaker = false;                      ///< for a rollback
    std::vector<ServedCertificate> certificates;     ///< in use
    std::shared_ptr<const config::Config> next;      ///< null: there is none
    std::string text;                                ///< of the file
    std::string read_only;                           ///< why the file cannot be written
    web::ReloadVerdict verdict;
    std::atomic<bool> is_late = false;  ///< nobody waits for it any more

    void read();
    void compare();
    void refuse_tokens();
};

bool allows_more(const web::Token& token, const web::Token& than) {
    const bool longer = than.expires && (!token.expires || *token.expires > *than.expires);
    return longer || token.standing.exceeds(than.standing);
}

/// A rollback brings back no token that was removed, and none that allows more than now.
config::Config with_tokens_of(const config::Config& config, const config::Config& running) {
    config::Config made = config;
    if (made.http && running.http) {
        made.http->tokens = running.http->tokens;
        for (web::Token& token : made.http->tokens) {
            const auto was = std::ranges::find(config.http->tokens, token.hash, &web::Token::hash);
            if (was != config.http->tokens.end() && !allows_more(*was, token)) token = *was;
        }
        if (made.http->anonymous.exceeds(running.http->anonymous))
            made.http->anonymous = running.http->anonymous;
    }
    return made;
}

/// Runs in the worker: all that takes long.
void Reloader::Job::read() try {
    if (rollback) {
        config::Config made = may_be_weaker ? *rollback : with_tokens_of(*rollback, *running);
        keep_certificates(made, certificates);
        next = std::make_shared<const config::Config>(std::move(made));
        verdict.weaker = explain::weaker(*running, *next);
        if (!verdict.weaker.empty() && !may_be_weaker) {
            next = nullptr;
            verdict.weaker = explain::weaker(*running, *rollback);  // tokens included
            verdict.outcome = ReloadOutcome::refused;
            verdict.why =
                "what ran before protects less than what runs now; ask with weaker where "
                "that is meant";
            return;
        }
    } else {
        explain::Loaded loaded = explain::read_file(file);
        text = std::move(loaded.text);
        read_only = why_read_only(file);
        for (const yaml::Problem& problem : loaded.problems)
            verdict.faults.push_back(fault_of(problem));
        if (!loaded.config) {
            verdict.outcome = ReloadOutcome::invalid;
            return;
        }
        config::share_profiles(*loaded.config, *running);
        for (const StartMessage& message : prepare(*loaded.config))
            verdict.warnings.push_back(message.event == "configuration"
                                           ? message.text
                                           : message.event + ": " + message.text);
        next = std::make_shared<const config::Config>(std::move(*loaded.config));
    }
    compare();
    if (rollback && verdict.outcome == ReloadOutcome::unchanged) refuse_tokens();
} catch (const std::exception& error) {
    next = nullptr;
    verdict.outcome = ReloadOutcome::failed;
    verdict.why = error.what();
}

/// Only tokens have changed since the former configuration, and the former tokens would allow more.
void Reloader::Job::refuse_tokens() {
    verdict.weaker = explain::weaker(*running, *rollback);
    if (verdict.weaker.empty()) return;
    next = nullptr;
    verdict.outcome = ReloadOutcome::refused;
    verdict.why =
        "only tokens, or who comes in without one, have changed since, and what ran before allows "
        "more; ask with weaker where that is meant";
}

void Reloader::Job::compare() {
    for (const explain::Change& change :
         explain::differences(but_equal_lines(*running, *next), but_equal_lines(*next, *running))) {
        verdict.changes.push_back(to_string(change));
        const std::string map = change.path.substr(0, change.path.find('/'));
        if (change.needs == config::kNextStart && !std::ranges::count(verdict.later, map))
            verdict.later.push_back(map);
    }
    for (std::string& moved : explain::moved_units(*running, *next))
        verdict.warnings.push_back(std::move(moved));
    verdict.outcome = verdict.changes.empty() ? ReloadOutcome::unchanged : ReloadOutcome::applied;
}

Reloader::Reloader(boost::asio::any_io_executor executor, rt::Clock& clock, std::string file)
    : clock_(clock),
      late_(clock.make_alarm()),
      file_(std::move(file)),
      worker_(std::move(executor)) {
    counters_.last_success_unix = unix_now();
    read_only_ = no_file();
    if (read_only_.empty()) read_only_ = why_read_only(file_);
}

std::string Reloader::no_file() const {
    if (file_.empty()) return "this gateway runs the built-in demo, which is no file";
    if (file_ == "-")
        return "the configuration was read from standard input, which is read only once";
    return {};
}

std::shared_ptr<const config::Config> Reloader::running() const { return gateway_->config(); }

void Reloader::serve(Gateway& gateway) { gateway_ = &gateway; }

std::string Reloader::barred(bool rollback) const {
    if (stopping_) return kStopping;
    if (waiting_.size() >= kWaiting) return "too many wait for a reload; try again";
    if (rollback)
        return before_ ? "" : "nothing else has run since the start, so there is no way back";
    return no_file();
}

void Reloader::reload(web::ReloadWish wish, std::string cause, Handler handler) {
    waiting_.push_back({wish, std::move(cause), std::move(handler)});
    if (served_.empty()) begin();
}

/// Serves all waiting requests of the same kind with one reload.
void Reloader::begin() {
    const web::ReloadWish wish = waiting_.front().wish;
    std::vector<Waiting> others;
    for (Waiting& one : std::exchange(waiting_, {}))
        (one.wish == wish ? served_ : others).push_back(std::move(one));
    waiting_ = std::move(others);
    if (step_) step_(true);
    auto job = std::make_shared<Job>();
    job->file = file_;
    job->running = gateway_->config();
    if (wish.rollback) job->rollback = before_;
    job->may_be_weaker = wish.weaker;
    job->certificates = gateway_->certificates();
    job->verdict.rollback = wish.rollback;
    job->verdict.cause = served_.front().cause;
    job_ = job;
    late_->arm(clock_.now() + kLongest, [this] { give_up(); });
    worker_.run(
        [job] {
            if (!job->is_late) job->read();
        },
        [this, job] {
            if (job == job_) apply(job);
        });
}

/// The worker may wait for the file for ever; what it reads in the end does not count.
void Reloader::give_up() {
    job_->is_late = true;
    web::ReloadVerdict verdict;
    verdict.rollback = served_.front().wish.rollback;
    verdict.cause = served_.front().cause;
    verdict.outcome = ReloadOutcome::failed;
    verdict.why = "it takes longer than " + std::to_string(kLongest / 1s) +
                  " s to read and check the files; is one of them on a share that does not answer?";
    end(verdict);
}

/// Runs in one turn of the loop.
void Reloader::apply(const std::shared_ptr<Job>& job) {
    if (!job->rollback) read_only_ = job->read_only;
    if (stopping_) {
        job->verdict.outcome = ReloadOutcome::failed;
        job->verdict.why = kStopping;
    } else if (job->next && job->verdict.outcome == ReloadOutcome::applied) {
        try {
            gateway_->apply(job->next);
            before_ = job->running;
            if (job->next->log != job->running->log) rt::set_up_log(job->next->log);
        } catch (const std::runtime_error& error) {  // a listener, a pty
            job->verdict.outcome = ReloadOutcome::failed;
            job->verdict.why = error.what();
        }
    }
    end(job->verdict);
}

void Reloader::end(web::ReloadVerdict& verdict) {
    late_->cancel();
    const std::shared_ptr<Job> job = std::exchange(job_, nullptr);
    verdict.at = rt::wall_now();
    const bool good =
        verdict.outcome == ReloadOutcome::applied || verdict.outcome == ReloadOutcome::unchanged;
    if (verdict.outcome != ReloadOutcome::refused) counters_.last_succeeded = good;
    ++counters_.reloads[static_cast<std::size_t>(verdict.outcome)];
    if (good) counters_.last_success_unix = unix_now();
    log_verdict(verdict);
    gateway_->record(verdict);
    if (good && !verdict.rollback && ran_) ran_(job->text, verdict.cause);
    last_ = std::make_shared<const web::ReloadVerdict>(std::move(verdict));
    if (step_) step_(false);
    for (Waiting& one : std::exchange(served_, {})) one.handler(last_);
    // Reading takes far more memory than is kept, and malloc would not return it to the system.
    worker_.run([] { ::malloc_trim(0); }, [] {});
    if (!waiting_.empty()) begin();
}

}  // namespace panelgate::gateway
