#pragma once

#include <string>
#include <string_view>

namespace panelgate::gateway {

/// Why a file cannot be replaced by one that is written beside it, or should not be; empty: it can.
/// Asks the disk.
std::string why_read_only(const std::string& file);
/// Writes a file in one step: whoever reads meanwhile has the old text or the new one, and a full
/// disk changes nothing. Returns why it has not; empty: done, and on the disk.
std::string replace_file(const std::string& file, std::string_view text);

}  // namespace panelgate::gateway
