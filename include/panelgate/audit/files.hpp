#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace panelgate::audit {

/// A full file's name: FILE.000000000001, with the number of its first record.
std::string rotated_name(const std::string& file, std::uint64_t first);
/// The full files of a chain, oldest first, without the one that is written.
std::vector<std::string> rotated_files(const std::string& file);
/// The number of a file's first record; 0: it has none, or its first line is no record.
std::uint64_t first_record(const std::string& file);

/// Calls `take` with each line, without its newline; `whole`: it had one. Ends where `take` returns
/// false. Returns why the file cannot be read, "" if it was.
std::string read_lines(const std::string& file,
                       const std::function<bool(std::string_view line, bool whole)>& take);

}  // namespace panelgate::audit
