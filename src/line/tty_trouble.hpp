#pragma once

#include <time.h>
#include <string>

#include "panelgate/base/time.hpp"

namespace panelgate::line {

/// Explains why open() of a device failed, and what would help: for EACCES its owner, the user of
/// this process, and the flag that Docker needs.
std::string explain_open_error(const std::string& device, int error);
/// Returns the owner of the flock() on this descriptor, from /proc/locks: "process 4711", or
/// "another program".
std::string holder_of_lock(int fd);

/// While it lives, a blocking system call of this thread is interrupted after `patience`, and
/// again: unless restarted, it ends with EINTR. The last close() of a serial device blocks for up
/// to 30 s until its driver has sent everything (closing_wait, which only root may change), and
/// with it all lines on the one loop; interrupted, it drops the rest. Uses SIGALRM.
class CallInterrupter {
  public:
    explicit CallInterrupter(Duration patience);
    ~CallInterrupter();
    CallInterrupter(const CallInterrupter&) = delete;
    CallInterrupter& operator=(const CallInterrupter&) = delete;

  private:
    timer_t timer_{};
    bool armed_ = false;
};

}  // namespace panelgate::line
