#include "serial_families.hpp"

#include <cstdint>

namespace panelgate::metrics {
namespace {

using serial_server::Counters;

struct MasterCounter {
    const char* name;
    const char* help;
    std::uint64_t Counters::* field;
};
constexpr MasterCounter kCounters[] = {
    {"panelgate_serial_master_requests_total",
     "Requests of a serial master to units that are served, broadcasts and repetitions included.",
     &Counters::requests},
    {"panelgate_serial_master_broadcasts_total", "Broadcasts of a serial master.",
     &Counters::broadcasts},
    {"panelgate_serial_master_repeated_total",
     "Requests of a serial master that got the answer of the same one before.",
     &Counters::repeated},
    {"panelgate_serial_master_replies_total", "Replies sent to a serial master.",
     &Counters::replies},
    {"panelgate_serial_master_exceptions_total", "Exceptions among the replies.",
     &Counters::exceptions},
    {"panelgate_serial_master_silent_total", "Failures that a serial master was told by silence.",
     &Counters::silent},
    {"panelgate_serial_master_superseded_total",
     "Requests given up because the serial master had begun to talk again.", &Counters::superseded},
    {"panelgate_serial_master_late_total",
     "Replies not sent because the serial master's timeout had passed.", &Counters::late},
    {"panelgate_serial_master_foreign_frames_total",
     "Good frames to and of units that are not served on a serial master's port.",
     &Counters::foreign},
    {"panelgate_serial_master_damaged_frames_total",
     "Bytes on a serial master's port that became no good frame, counted once a frame.",
     &Counters::damaged},
    {"panelgate_serial_master_reopens_total",
     "Successful opens of a serial master's port after the first.", &Counters::reopens},
};

}  // namespace

void add_serial_masters(Families& out, const Snapshot& snapshot) {
    if (snapshot.serial_masters.empty()) return;
    Family up = make_gauge("panelgate_serial_master_up", "1 while a serial master's port is open.");
    for (const Counters& master : snapshot.serial_masters)
        up.gauge({{"master", master.master}}, master.up ? 1 : 0);
    out.push_back(up.take());
    for (const MasterCounter& counter : kCounters) {
        Family family = make_counter(counter.name, counter.help);
        for (const Counters& master : snapshot.serial_masters)
            family.counter({{"master", master.master}}, master.*counter.field);
        out.push_back(family.take());
    }
}

}  // namespace panelgate::metrics
