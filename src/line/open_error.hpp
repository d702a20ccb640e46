#pragma once

#include <string>

namespace panelgate::line {

/// Why open() of a device failed, with what would help: for EACCES who owns it, who we are, and the
/// flag that Docker needs.
std::string explain_open_error(const std::string& device, int error);
/// Who holds the flock() of this descriptor, from /proc/locks: "process 4711", or "another
/// program".
std::string holder_of_lock(int fd);

}  // namespace panelgate::line
