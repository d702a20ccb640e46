#!/usr/bin/env python3
"""Measures the gateway beside the ideal master and its rivals, and holds it against its bars.

Bus, load and ideal master are independent programs (rtubus.cpp, mbload.cpp and bare.cpp in
$PANELGATE_TOOLS, else ../shared/tools beside this tree). What is compared takes turns on one bus in
one run. --out gets results.json and table.md. Bars are for the first --program.
"""
import argparse
import collections
import datetime
import os
import pathlib
import platform
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
from measures import figures, latency, report, rig, saturated  # noqa: E402

Run = collections.namedtuple("Run", "tools gateways rivals quick")
Run.__doc__ = "`gateways`: builds of ours, the judged one first; `rivals`: programs of others."

TOPICS = {
    "wire": saturated.measure,
    "unpaced": saturated.measure_unpaced,
    "busy": saturated.measure_busy,
    "beside": saturated.measure_beside,
    "latency": latency.measure,
}
BARS = saturated.BARS + latency.BARS


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
    print(f"{row.measure:<44}{row.case:<28}{row.subject:<16}{report.number(row.value):>9} "
          f"{row.unit}{'  ' + str(row.detail['errors']) if row.detail and 'errors' in row.detail else ''}",
          flush=True)


def write(options, rows, left_out):
    rows = figures.medians(rows)
    judged = options.program[0].name
    head = f"{machine()}{'; quick' if options.quick else ''}"
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "table.md").write_text(report.table(rows, BARS, judged, head, left_out))
    (options.out / "results.json").write_text(report.as_json(rows, BARS, head, left_out))
    print(report.bars_table(rows, BARS, judged), end="")
    print(f"{options.out}: table.md, results.json")


def main():
    options = parse_arguments()
    options.program = options.program or [program(f"panelgate={rig.harness.PANELGATE}")]
    for subject in options.program:
        if reason := subject.unavailable():
            sys.exit(f"driver.py: {reason}")
    print(machine())
    rows, left_out = [], []
    with tempfile.TemporaryDirectory() as folder:
        tools = rig.build_tools(folder)
        if tools is None:
            sys.exit(f"driver.py: rtubus.cpp, mbload.cpp and bare.cpp are not in {rig.wire.TOOLS}")
        run = Run(tools, options.program, [], options.quick)
        for name, measure in TOPICS.items():
            if not options.only or name in options.only:
                for row in measure(run):
                    show(row)
                    rows.append(row)
    write(options, rows, left_out)


if __name__ == "__main__":
    main()
