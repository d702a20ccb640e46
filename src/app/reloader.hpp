#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "panelgate/base/time.hpp"
#include "panelgate/config/config.hpp"
#include "panelgate/config/counters.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/rt/worker.hpp"
#include "panelgate/web/api/sources.hpp"

namespace panelgate::app {

/// Tells that a file is another one, or has another content, through all links: editors put a new
/// one in its place, Kubernetes turns a link of a folder above. It is looked at now and then beside
/// the loop, because not every file system tells; and told when two looks agree, so that whoever
/// writes it has ended. A file that has gone is no news before there is one again. One thread; the
/// clock outlives it.
class FileWatch {
  public:
    static constexpr Duration kEvery = 1s;

    FileWatch(boost::asio::any_io_executor executor, rt::Clock& clock, std::string path,
              std::function<void()> changed);

  private:
    /// Device, inode, size, and when it changed last; nanoseconds.
    using Stamp =
        std::optional<std::tuple<std::uint64_t, std::uint64_t, std::int64_t, std::int64_t>>;
    static Stamp stamp_of(const std::string& path);
    void later();
    void look();
    void judge(const Stamp& seen);

    std::string path_;
    std::function<void()> changed_;
    rt::Clock& clock_;
    std::unique_ptr<rt::Alarm> alarm_;
    Stamp known_;  ///< that was told, or there from the first
    Stamp seen_;   ///< by the last look
    rt::Worker worker_;
    std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

class Gateway;

/// Reads the file again and has the gateway serve it: read, checked and compared beside the loop,
/// applied in one turn of it. What cannot be applied changes nothing. One reload at a time; those
/// who come meanwhile are told of the next one. One thread.
class Reloader final : public web::ReloadSource {
  public:
    /// `file`: what was read at the start; empty or `-`: nothing that could be read again.
    Reloader(boost::asio::any_io_executor executor, std::string file);
    /// Before anything is asked of it. The gateway lives as long as the loop runs.
    void serve(Gateway& gateway);
    /// Told at the beginning of each reload, and at its end.
    void on_step(std::function<void(bool begins)> step) { step_ = std::move(step); }

    /// The program ends: what is under way is not applied, and nothing more is read.
    void stop() { stopping_ = true; }

    std::string barred(bool rollback) const override;
    void reload(web::ReloadWish wish, std::string cause, Handler handler) override;
    std::shared_ptr<const web::ReloadVerdict> last() const override { return last_; }
    const config::ReloadCounters& counters() const { return counters_; }
    const std::string& file() const { return file_; }

  private:
    struct Job;
    struct Waiting {
        web::ReloadWish wish;
        std::string cause;
        Handler handler;
    };

    void begin();
    void apply(const std::shared_ptr<Job>& job);
    void end(const std::shared_ptr<Job>& job);

    std::string file_;
    Gateway* gateway_ = nullptr;
    std::shared_ptr<const config::Config> before_;  ///< what ran before; null: nothing else has
    std::vector<Waiting> waiting_;
    std::vector<Waiting> served_;  ///< by the one under way
    std::function<void(bool)> step_;
    bool stopping_ = false;
    std::shared_ptr<const web::ReloadVerdict> last_;
    config::ReloadCounters counters_;
    rt::Worker worker_;
};

}  // namespace panelgate::app
