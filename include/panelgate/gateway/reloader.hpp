#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/config/counters.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/rt/process.hpp"
#include "panelgate/web/api/sources.hpp"

namespace panelgate::gateway {

/// Reports that one of some files was replaced or changed, through all links: editors replace the
/// file, Kubernetes redirects a link of a folder above. Polls it in a worker, because not every
/// file system notifies; reports when two polls agree, so that the writer has finished. A file that
/// has vanished is reported only when it is back. One thread; the clock outlives it.
class FileWatch {
  public:
    static constexpr Duration kEvery = 1s;

    /// `files` gives the paths at each look. A new path counts as a change: its file may have
    /// changed since the reload that named it.
    FileWatch(boost::asio::any_io_executor executor, rt::Clock& clock,
              std::function<std::vector<std::string>()> files, std::function<void()> changed);

  private:
    /// Device, inode, size and time of the last change in ns.
    using Stamp =
        std::optional<std::tuple<std::uint64_t, std::uint64_t, std::int64_t, std::int64_t>>;
    using Stamps = std::map<std::string, Stamp>;
    static Stamps stamps_of(const std::vector<std::string>& paths);
    void later();
    void look();
    void judge(const Stamps& seen);

    std::function<std::vector<std::string>()> files_;
    std::function<void()> changed_;
    rt::Clock& clock_;
    std::unique_ptr<rt::Alarm> alarm_;
    Stamps known_;  ///< last reported, or found at the start
    Stamps seen_;   ///< of the last poll
    rt::Worker worker_;
    std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

class Gateway;

/// Reloads the file: reads, checks and compares it in a worker, applies it in one turn of the loop.
/// A configuration that cannot be applied changes nothing; nor one that is not read within
/// kLongest, as where a share does not answer. One reload at a time; requests that come meanwhile
/// get the result of the next one. One thread.
class Reloader final : public web::ReloadSource {
  public:
    static constexpr Duration kLongest = 10s;

    /// `file`: the file read at the start; empty or `-`: it cannot be read again. The clock
    /// outlives this.
    Reloader(boost::asio::any_io_executor executor, rt::Clock& clock, std::string file);
    /// Call before any other function. The gateway lives as long as the loop runs.
    void serve(Gateway& gateway);
    /// `step` is called at the beginning of each reload, and at its end.
    void on_step(std::function<void(bool begins)> step) { step_ = std::move(step); }
    /// `ran` is called with each text that is served from now on, and who caused that.
    void on_ran(std::function<void(const std::string& text, const std::string& cause)> ran) {
        ran_ = std::move(ran);
    }

    /// The program ends: a running reload is not applied, and no other one starts.
    void stop() { stopping_ = true; }

    std::string barred(bool rollback) const override;
    void reload(web::ReloadWish wish, std::string cause, Handler handler) override;
    std::shared_ptr<const web::ReloadVerdict> last() const override { return last_; }
    /// Whoever wrote the text that was refused has put the former text back.
    void taken_back() { counters_.last_succeeded = true; }
    const config::ReloadCounters& counters() const { return counters_; }
    const std::string& file() const { return file_; }
    /// Why there is no file to be read; empty: there is.
    std::string no_file() const;
    /// Why the file could not be written when it was read last; empty: it could.
    const std::string& read_only() const { return read_only_; }
    std::shared_ptr<const config::Config> running() const;

  private:
    struct Job;
    struct Waiting {
        web::ReloadWish wish;
        std::string cause;
        Handler handler;
    };

    void begin();
    void apply(const std::shared_ptr<Job>& job);
    void give_up();
    void end(web::ReloadVerdict& verdict);

    rt::Clock& clock_;
    std::unique_ptr<rt::Alarm> late_;
    std::string file_;
    Gateway* gateway_ = nullptr;
    std::shared_ptr<Job> job_;                      ///< the running reload; null: none
    std::shared_ptr<const config::Config> before_;  ///< the previous one; null: none
    std::vector<Waiting> waiting_;
    std::vector<Waiting> served_;  ///< by the running reload
    std::function<void(bool)> step_;
    std::function<void(const std::string&, const std::string&)> ran_;
    std::string read_only_;
    bool stopping_ = false;
    std::shared_ptr<const web::ReloadVerdict> last_;
    config::ReloadCounters counters_;
    rt::Worker worker_;
};

}  // namespace panelgate::gateway
