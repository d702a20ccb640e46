#pragma once

#include <string>

#include "panelgate/bus/trace.hpp"

namespace panelgate::web {

/// A part of a trace for people at a terminal: a row for each transaction with its times in
/// milliseconds, its frames below it, and decisions between them in the order of the line.
std::string trace_text(const bus::TracePart& part);

}  // namespace panelgate::web
