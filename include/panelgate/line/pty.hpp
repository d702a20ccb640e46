#pragma once

#include <string>

#include "panelgate/base/serial_format.hpp"

namespace panelgate::line {

/// A pseudo-terminal pair: programs open path() as if it were a serial device, the simulated bus
/// reads and writes master(). No parity, no pacing, no echo of its own. Both ends are closed with
/// it.
class Pty {
  public:
    /// Its users speak this format until they set another. Throws std::system_error when the system
    /// has none left.
    explicit Pty(const SerialFormat& format = {});
    ~Pty();
    Pty(const Pty&) = delete;
    Pty& operator=(const Pty&) = delete;

    int master() const { return master_; }  ///< non-blocking
    const std::string& path() const { return path_; }

  private:
    int master_ = -1;
    int slave_ = -1;  ///< held open, so that the master does not hang up between two users
    std::string path_;
};

}  // namespace panelgate::line
