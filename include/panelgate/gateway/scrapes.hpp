#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "panelgate/metrics/exposition.hpp"
#include "panelgate/rt/process.hpp"
#include "panelgate/web/api/sources.hpp"

namespace panelgate::gateway {

/// Answers /metrics. The loop only copies the figures, in pieces between which it serves other
/// work; a worker renders and packs the text. A scrape that arrives meanwhile gets the next text,
/// whose figures are all copied later, together with the other waiting scrapes.
class Scrapes final : public web::MetricsSource {
  public:
    /// Copies one piece; false: it was the last.
    using Copy = std::function<bool(metrics::Snapshot&)>;
    struct Settings {
        std::size_t waiting = 256;                     ///< scrapes that may wait for a text
        std::size_t sending_bytes = 64 * 1024 * 1024;  ///< of texts that are being sent
    };

    /// `begin` starts a copy; what the copy refers to outlives this.
    Scrapes(boost::asio::any_io_executor executor, std::function<Copy()> begin, Settings settings);
    ~Scrapes() override;
    Scrapes(const Scrapes&) = delete;
    Scrapes& operator=(const Scrapes&) = delete;

    void scrape(std::uint64_t caller, bool gzip, Handler handler) override;
    void cancel(std::uint64_t caller) override;

  private:
    struct Job;
    struct Waiter {
        std::uint64_t caller = 0;
        bool gzip = false;
        Handler handler;
    };

    void begin();
    void step();
    void write();
    void end();
    void drop(std::vector<Waiter>& waiters, std::uint64_t caller);
    void hand_over(Handler handler, web::SharedText text);
    std::size_t sending_bytes();

    boost::asio::any_io_executor executor_;
    std::function<Copy()> begin_;
    Settings settings_;
    std::vector<Waiter> waiting_;  ///< for the next text
    std::vector<Waiter> served_;   ///< by the running job
    Copy copy_;                    ///< while figures are copied
    std::shared_ptr<Job> job_;     ///< the running job
    std::vector<std::weak_ptr<const std::string>> sent_;
    std::size_t last_size_ = 0;
    std::shared_ptr<Scrapes*> self_ = std::make_shared<Scrapes*>(this);  ///< for posted handlers
    rt::Worker worker_;
};

}  // namespace panelgate::gateway
