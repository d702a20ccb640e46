#pragma once

#include <optional>
#include <string_view>

namespace panelgate::metrics {

/// The process_* metrics of the Prometheus client conventions; a figure that could not be read is
/// absent.
struct ProcessFacts {
    std::optional<double> cpu_seconds;  ///< user and system, since the start
    std::optional<double> resident_bytes;
    std::optional<double> virtual_bytes;
    std::optional<double> open_fds;
    std::optional<double> max_fds;          ///< soft limit
    std::optional<double> start_time_unix;  ///< seconds since 1970
};

/// Reads them for this process from /proc (proc(5)). Never throws.
ProcessFacts read_process_facts();

/// Units of the figures in /proc.
struct ProcUnits {
    double ticks_per_second = 100;
    double page_bytes = 4096;
    std::optional<double> boot_unix;  ///< `btime` of /proc/stat
};
/// Parses /proc/PID/stat (proc(5): fields 14, 15, 22, 23, 24); all absent if malformed. The command
/// name may contain blanks and parentheses.
ProcessFacts parse_stat(std::string_view stat, const ProcUnits& units);

}  // namespace panelgate::metrics
