#pragma once

#include <time.h>
#include <string>

#include "panelgate/base/time.hpp"

namespace panelgate::line {

/// Why open() of a device failed, with what would help: for EACCES who owns it, who we are, and the
/// flag that Docker needs.
std::string explain_open_error(const std::string& device, int error);
/// Who holds the flock() of this descriptor, from /proc/locks: "process 4711", or "another
/// program".
std::string holder_of_lock(int fd);

/// While it lives, a call of this thread that sleeps in the kernel is interrupted after `patience`,
/// and again: one that is not started anew ends with EINTR. The last close() of a serial device
/// sleeps for up to 30 s until its driver has sent everything (closing_wait, which only root may
/// change), and on the one loop all lines would wait with it; interrupted, it drops the rest. Takes
/// SIGALRM for it.
class Impatience {
  public:
    explicit Impatience(Duration patience);
    ~Impatience();
    Impatience(const Impatience&) = delete;
    Impatience& operator=(const Impatience&) = delete;

  private:
    timer_t timer_{};
    bool armed_ = false;
};

}  // namespace panelgate::line
