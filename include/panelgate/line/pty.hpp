#pragma once

#include <string>

#include "panelgate/base/serial_format.hpp"

namespace panelgate::line {

/// A pseudo-terminal pair: programs open path() like a serial device, the simulated bus uses
/// master(). No parity, no pacing, no echo. Owns both ends.
class Pty {
  public:
    /// Users have this format until they set another. Throws std::system_error if no
    /// pseudo-terminal is left.
    explicit Pty(const SerialFormat& format = {});
    ~Pty();
    Pty(const Pty&) = delete;
    Pty& operator=(const Pty&) = delete;

    int master() const { return master_; }  ///< non-blocking
    const std::string& path() const { return path_; }

  private:
    int master_ = -1;
    int slave_ = -1;  ///< kept open, so that the master sees no hang-up between two users
    std::string path_;
};

}  // namespace panelgate::line
