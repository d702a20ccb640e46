#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace panelgate::store {

struct Settings {
    std::string file;                        ///< of SQLite; "": in memory, gone with the process
    std::uint64_t size = 200 * 1024 * 1024;  ///< bytes of the file; SQLite's log adds some 4 MiB
    unsigned days = 30;                      ///< how long entries and samples are kept
    std::size_t points = 16'000;             ///< whose values are kept; 1 KB of memory each
    std::size_t cache = 256 * 1024;          ///< bytes of the file that SQLite keeps in memory
    std::size_t queue = 10'000;  ///< writes that wait for the disk; further ones are lost

    friend bool operator==(const Settings&, const Settings&) = default;
};

}  // namespace panelgate::store
