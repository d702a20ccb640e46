#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <map>
#include <memory>
#include <string>

#include "panelgate/gateway/snapshot.hpp"
#include "panelgate/images/image_bus.hpp"
#include "panelgate/rt/clock.hpp"

namespace panelgate::gateway {

/// The images by name, those of earlier configurations too: a client that still refers to one gets
/// an answer. One thread; the executor and the clock outlive it.
class Images {
  public:
    Images(boost::asio::any_io_executor executor, rt::Clock& clock, images::Refused refused);

    /// Adds the images of the configuration to the plant.
    void add_to(Plant& plant, const config::Config& config);
    /// Shows the snapshot's points from now on.
    void show(const std::shared_ptr<const Snapshot>& snapshot);

  private:
    images::ImageBus& bus(const std::string& name);

    boost::asio::any_io_executor executor_;
    rt::Clock& clock_;
    images::Refused refused_;
    std::map<std::string, std::unique_ptr<images::ImageBus>> buses_;
};

}  // namespace panelgate::gateway
