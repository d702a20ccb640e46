#pragma once

#include <optional>
#include <string_view>

namespace panelgate::metrics {

/// What the Prometheus client conventions call process_*; an absent figure could not be read.
struct ProcessFacts {
    std::optional<double> cpu_seconds;  ///< user and system, since the start
    std::optional<double> resident_bytes;
    std::optional<double> virtual_bytes;
    std::optional<double> open_fds;
    std::optional<double> max_fds;          ///< the soft limit
    std::optional<double> start_time_unix;  ///< seconds since 1970
};

/// Of this process, now, from /proc (proc(5)). Never throws.
ProcessFacts read_process_facts();

/// Units in which /proc counts.
struct ProcUnits {
    double ticks_per_second = 100;
    double page_bytes = 4096;
    std::optional<double> boot_unix;  ///< `btime` of /proc/stat
};
/// The figures of /proc/PID/stat (proc(5): fields 14, 15, 22, 23, 24); none when the text is not
/// one. The command name may hold blanks and parentheses.
ProcessFacts parse_stat(std::string_view stat, const ProcUnits& units);

}  // namespace panelgate::metrics
