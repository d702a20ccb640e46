#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <tuple>

#include "panelgate/base/time.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/rt/worker.hpp"

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

}  // namespace panelgate::app
