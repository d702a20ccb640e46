#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace panelgate::commands {

/// A serial adapter by the name to give it, and what that points to.
struct Adapter {
    std::string name;  ///< "/dev/serial/by-id/usb-FTDI_...", or "/dev/ttyUSB0" without such a link
    std::string device;  ///< "ttyUSB0"
    friend bool operator==(const Adapter&, const Adapter&) = default;
};

/// The USB adapters below `dev`, which is /dev: links in serial/by-id, then ttyUSB* and ttyACM*
/// that have none.
std::vector<Adapter> adapters(const std::filesystem::path& dev);
/// What to say to somebody who needs one; several lines.
std::string adapters_text(const std::vector<Adapter>& list);

}  // namespace panelgate::commands
