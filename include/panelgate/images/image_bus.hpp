#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <vector>

#include "panelgate/bus/bus_client.hpp"
#include "panelgate/images/layout.hpp"
#include "panelgate/images/settings.hpp"
#include "panelgate/points/station_points.hpp"
#include "panelgate/profile/load_profile.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::images {

/// The station behind a place of a layout.
struct Source {
    bus::BusClient* bus = nullptr;  ///< never null; outlives the image
    std::uint8_t station = 0;
    profile::ProfileRef profile;
    const points::StationPoints* points = nullptr;  ///< never null
    Duration deadline{};                            ///< of a request in the line's queue
};

/// An image with what it shows.
struct Content {
    Settings settings;
    Layout layout;
    std::vector<Source> sources;        ///< of each place
    std::shared_ptr<const void> owner;  ///< keeps the stations' points alive
};

/// Hears of a client's write that the image itself refuses: it comes to no line.
using Refused = std::function<void(const WhoRef& who, std::uint8_t unit, ByteView pdu)>;

/// Answers Modbus requests to an image: reads from the points' last values, without its lines;
/// writes as writes of the points, each by its own line. Single-threaded; the executor and the
/// clock outlive it.
class ImageBus final : public bus::BusClient {
  public:
    ImageBus(boost::asio::any_io_executor executor, rt::Clock& clock, Refused refused);
    ~ImageBus() override;

    /// What is shown from now on; null: nothing, each request gets 0A.
    void show(std::shared_ptr<const Content> content) { content_ = std::move(content); }

    void transact(bus::Request request, bus::AnswerHandler handler) override;
    void count_refused(std::uint8_t station, ByteView pdu, const WhoRef& who) override;
    void cancel(bus::ClientId client) override;
    void name_client(bus::ClientId client, std::string name) override;
    bus::LineStatus status() const override;
    bus::StationStatus station_status(std::uint8_t station) const override;
    bus::TracePart trace(std::size_t last) const override;

  private:
    struct Writing;
    using Pdu = Result<Bytes>;

    Pdu read(const bus::Request& request) const;
    bool may_read(const Source& source, const Place& place, const WhoRef& who) const;
    Pdu begin_write(const bus::Request& request, bus::AnswerHandler& handler);
    Pdu plan(const bus::Request& request, Writing& writing) const;
    Pdu plan_point(std::size_t place, std::span<const std::uint16_t> items,
                   const bus::Request& request, Writing& writing) const;
    void go_on(const std::shared_ptr<Writing>& writing);
    void on_answer(const std::shared_ptr<Writing>& writing, bus::Answer answer);
    void answer(bus::AnswerHandler handler, Pdu pdu);

    boost::asio::any_io_executor executor_;
    rt::Clock& clock_;
    Refused refused_;
    std::shared_ptr<const Content> content_;
    std::list<std::weak_ptr<Writing>> writings_;  ///< under way
};

}  // namespace panelgate::images
