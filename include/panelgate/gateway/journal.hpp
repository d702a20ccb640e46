#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "panelgate/audit/record.hpp"
#include "panelgate/bus/bus.hpp"
#include "panelgate/gateway/plant.hpp"
#include "panelgate/rt/clock.hpp"
#include "panelgate/rt/process.hpp"
#include "panelgate/store/entry.hpp"
#include "panelgate/store/store.hpp"

namespace panelgate::gateway {

struct Snapshot;
struct Station;

/// Where the store's file is: the configured one, else in the folder that systemd or the image
/// gives ($STATE_DIRECTORY); "" (in memory) if that folder cannot be written.
std::string store_file(const store::Settings& settings);

/// Writes what happens and the values of points into the store. An object of the plant's loop.
class Journal {
  public:
    /// The clock outlives it.
    Journal(boost::asio::any_io_executor executor, rt::Clock& clock);
    ~Journal();
    Journal(const Journal&) = delete;
    Journal& operator=(const Journal&) = delete;

    /// Opens the store as configured; one that stays the same goes on.
    void apply(const store::Settings& settings);
    /// The stations and points that are named from now on.
    void show(std::shared_ptr<const Snapshot> snapshot) {
        snapshot_ = std::move(snapshot);
        places_.clear();
    }
    /// Writes what waits, and closes the store.
    void close();

    /// The entry gets the time of now.
    void add(store::Entry entry);
    /// Keeps a text in the store, as Database::keep().
    void keep(const std::string& key, const std::string& text);
    void on_event(const std::string& line, const bus::BusEvent& event);
    /// Values of the points among these wants of the station's polls.
    void on_points(const Station& station, const std::vector<std::size_t>& wants);
    /// What is worth an entry of what the audit records.
    void on_record(const audit::Members& record);
    /// Runs `read` in the store's thread (null: nothing can be read), then `done` in this loop.
    /// Both may be called after the journal's end.
    void ask(std::function<void(const store::Database*)> read, std::function<void()> done);
    using Texts = std::vector<std::pair<std::string, std::string>>;  ///< key, text
    /// Calls `done` in this loop with the kept texts whose keys begin with `prefix`; with none if
    /// nothing can be read. As ask() otherwise.
    void ask_kept(std::string_view prefix, std::function<void(const Texts&)> done);
    /// Hands over the values of a point, "STATION/POINT", that the store does not have yet.
    void flush(const std::string& point);
    /// Nothing before apply().
    std::optional<store::Counters> counters() const;
    const std::string& file() const { return settings_.file; }
    /// Why nothing can be written; "": writes are taken.
    std::string why() const { return store_ ? store_->why() : ""; }

  private:
    struct Running {
        std::int64_t number = 0;
        store::Block block{};
    };

    using Blocks = std::map<std::string, Running>;

    Blocks::value_type* block_of(const Station& station, const points::Point& point);
    void tell(bool failing, const std::string& why) const;
    void look();
    void write(const std::string& point, Running& running);
    void on_line(const std::string& line, const bus::LineEvent& event);
    void on_station(const std::string& line, const arbiter::StationEvent& event);

    boost::asio::any_io_executor executor_;
    rt::Clock& clock_;
    std::unique_ptr<rt::Alarm> alarm_;
    std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
    store::Settings settings_;  ///< of the open store
    std::unique_ptr<store::Store> store_;
    std::optional<rt::Worker> closing_;  ///< ends stores
    std::shared_ptr<const Snapshot> snapshot_;
    std::map<std::string, bool> lines_;  ///< up, by name
    Blocks blocks_;                      ///< that still grow, by "STATION/POINT"
    /// The blocks of a station's points, in their order; null: not found yet.
    std::map<const Station*, std::vector<Blocks::value_type*>> places_;
    bool told_full_ = false;
};

}  // namespace panelgate::gateway
