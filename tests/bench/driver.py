#!/usr/bin/env python3
"""Measures the gateway beside the ideal master and its rivals, and holds it against its bars.

Bus, load and ideal master are independent programs (rtubus.cpp, mbload.cpp and bare.cpp in
$PANELGATE_TOOLS, else ../shared/tools beside this tree). What is compared takes turns on one bus in
one run. --out gets results.json, table.md and plot.svg. Bars are for the first --program.
"""
import argparse
import collections
import datetime
import os
import pathlib
import platform
import subprocess
import sys
import tempfile
import traceback

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
from measures import (cost, costly, counts, crowd, dead, figures, growth, latency, lines,  # noqa: E402
                      master, memory, micro, plot, readers, reload, report, rig, rivals, saturated, scrape)

Run = collections.namedtuple("Run", "tools gateways rivals quick rates left_out")
Run.__doc__ = """`gateways`: builds of ours, the judged one first; `rivals`: programs of others; `left_out`:
what could not be measured, and why; `rates`: of the topics that have many."""

TOPICS = {
    "wire": saturated.measure,
    "unpaced": saturated.measure_unpaced,
    "tcp": saturated.measure_tcp,
    "busy": saturated.measure_busy,
    "beside": saturated.measure_beside,
    "readers": readers.measure,
    "costly": costly.measure,
    "latency": latency.measure,
    "crowd": crowd.measure,
    "master": master.measure,
    "dead": dead.measure,
    "writes": dead.measure_writes,
    "lines": lines.measure,
    "memory": memory.measure,
    "start": memory.measure_start,
    "instructions": counts.measure_instructions,
    "allocations": counts.measure_allocations,
    "scrape": scrape.measure,
    "reload": reload.measure,
    "cost": cost.measure,
    "growth": growth.measure,
    "micro": micro.measure,
}
BROKEN = "broken off:"
BARS = [bar for topic in (saturated, latency, crowd, master, lines, memory, counts, scrape, readers, costly,
                          reload, cost)
        for bar in topic.BARS]


def program(text):
    """NAME=PATH, or a path that is its own name."""
    name, equals, path = text.rpartition("=")
    path = pathlib.Path(path).resolve()
    return rig.Panelgate(name if equals else path.name, path)


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer cases, less time")
    parser.add_argument("--only", action="append", choices=TOPICS, metavar="NAME",
                        help=f"of {', '.join(TOPICS)}; may be repeated")
    parser.add_argument("--program", action="append", type=program, metavar="[NAME=]PATH",
                        help="a gateway; several take turns, the first is judged "
                             "(default: $PANELGATE, else build/release/panelgate)")
    parser.add_argument("--no-rivals", action="store_true")
    parser.add_argument("--rates", type=int, nargs="+", metavar="BAUD", default=saturated.RATES,
                        help="of the topics wire and busy (all that are measured)")
    parser.add_argument("--add", action="store_true", help="keep the other figures that --out has")
    parser.add_argument("--out", type=pathlib.Path, default=rig.harness.ROOT / "build/bench")
    return parser.parse_args()


def machine():
    model = "unknown processor"
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            model = line.partition(":")[2].strip()
            break
    return (f"{platform.machine()}, {os.cpu_count()} cores, {model}, Linux {platform.release()}, "
            f"{datetime.date.today()}")


def show(row):
    print(f"{row.measure:<44}{row.case:<40}{row.subject:<17}{report.number(row.value):>9} "
          f"{row.unit}{'  ' + str(row.detail['errors']) if row.detail and 'errors' in row.detail else ''}",
          flush=True)


def write(options, rows, left_out):
    rows = figures.medians(rows)
    if options.add and (options.out / "results.json").exists():
        rows = report.updated(report.from_json((options.out / "results.json").read_text()), rows)
    judged = options.program[0].name
    head = f"{machine()}{'; quick' if options.quick else ''}"
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "table.md").write_text(report.table(rows, BARS, judged, head, left_out))
    (options.out / "results.json").write_text(report.as_json(rows, BARS, head, left_out))
    (options.out / "plot.svg").write_text(plot.svg(rows, BARS, head))
    print(report.bars_table(rows, BARS, judged), end="")
    print(f"{options.out}: table.md, results.json, plot.svg")


def rows_of(name, run):
    """Of one topic; one that breaks leaves the others their figures."""
    rows = []
    try:
        for row in TOPICS[name](run):
            show(row)
            rows.append(row)
    except (AssertionError, OSError, subprocess.SubprocessError, ValueError):
        traceback.print_exc()
        run.left_out.append(f"{BROKEN} {name}")
    return rows


def main():
    options = parse_arguments()
    options.program = options.program or [program(f"panelgate={rig.harness.PANELGATE}")]
    for subject in options.program:
        if reason := subject.unavailable():
            sys.exit(f"driver.py: {reason}")
    print(machine())
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        tools = rig.build_tools(folder)
        if tools is None:
            sys.exit(f"driver.py: rtubus.cpp, mbload.cpp and bare.cpp are not in {rig.wire.TOOLS}")
        others, left_out = ([], []) if options.no_rivals else rivals.all_there_are(folder)
        run = Run(tools, options.program, others, options.quick, options.rates, left_out)
        for name in options.only or TOPICS:
            rows += rows_of(name, run)
    write(options, rows, report.in_order(left_out))
    sys.exit(any(what.startswith(BROKEN) for what in left_out))


if __name__ == "__main__":
    main()
