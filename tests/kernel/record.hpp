#pragma once

#include <iosfwd>

namespace panelgate::line {

/// Asks the driver of an open device everything that src/line asks and writes what it answered, one
/// line a request (README.md has the format). Leaves the device raw, at 9600 8N1.
void record(int fd, std::ostream& out);

/// The same to the console, as lines "record TABLE: ..." from which host.py makes a file.
void report(const char* table, int fd);

}  // namespace panelgate::line
