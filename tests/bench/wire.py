#!/usr/bin/env python3
"""How much of a paced RS-485 line the gateway uses: the figures behind promises P1, P4, P5 and P6.

TOOLS is a folder with rtubus.cpp, an independent paced bus with faults, and mbload.cpp, a load
generator (default: $PANELGATE_TOOLS, else ../shared/tools beside this tree). Prints one table with
machine and date; all ratios come from one run on one machine.
"""
import argparse
import concurrent.futures
import datetime
import json
import os
import pathlib
import platform
import statistics
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve()
sys.path.insert(0, str(HERE.parents[1] / "system"))
import config  # noqa: E402
import harness  # noqa: E402
from harness import Output, Program  # noqa: E402

TOOLS = pathlib.Path(os.environ.get("PANELGATE_TOOLS", HERE.parents[3] / "shared/tools"))
RATES = (9600, 19200, 38400, 115200)
BITS = 11  # of a character: 8E1
THINK = 500e-6  # of rtubus' stations


def build_tools(folder, tools=TOOLS):
    """{name: program}; None when the sources are not there."""
    sources = {name: tools / f"{name}.cpp" for name in ("rtubus", "mbload")}
    if not all(source.exists() for source in sources.values()):
        return None
    built = {}
    for name, source in sources.items():
        built[name] = str(pathlib.Path(folder) / name)
        subprocess.run(["g++", "-O2", "-std=c++17", "-pthread", "-w", "-o", built[name], str(source)],
                       check=True)
    return built


def wire_limit(baud, registers=10):
    """Transactions a second: 1 / (request + t3.5 + think time + reply + t3.5)."""
    character = BITS / baud
    gap = 3.5 * character if baud <= 19200 else 1.75e-3
    return 1 / (8 * character + gap + THINK + (5 + 2 * registers) * character + gap)


class PacedLine:
    """rtubus with these stations; `link` is the tty. `options`: more of rtubus' own."""

    def __init__(self, tools, folder, baud, options=(), pass_fds=(), stations="1-8"):
        self.tools = tools
        self.link = f"{folder}/tty{baud}-{id(self)}"
        self.bus = subprocess.Popen([tools["rtubus"], "--baud", str(baud), "--bus",
                                     f"{self.link}={stations}", *options], pass_fds=pass_fds,
                                    stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.bus.stdout.readline()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.bus.communicate("quit\n")

    def tell(self, command):
        self.bus.stdin.write(command + "\n")
        self.bus.stdin.flush()
        return self.bus.stdout.readline()

    def all_stats(self):
        """Of each bus, in the order of the options."""
        return json.loads(self.tell("stats"))

    def stats(self):
        return self.all_stats()[0]


class Bus(PacedLine):
    """A paced line and a gateway on it; `settings`: more keys of its line."""

    def __init__(self, tools, folder, baud, faults=(), settings=None, log=False, echo=0):
        options = ["--echo", str(echo)]
        for fault in faults:
            options += ["--fault", fault]
        read, write = os.pipe()
        if log:
            options += ["--log", f"/dev/fd/{write}"]
        super().__init__(tools, folder, baud, options, [write])
        os.close(write)
        self.log = Output(os.fdopen(read))  # a line for every frame: START END BUS KIND hex...
        line = config.line("wire", self.link, config.station_ids(range(1, 9)), baud=baud,
                           parity="even", **(settings or {}))
        file = pathlib.Path(f"{self.link}.yaml")
        file.write_text(config.gateway(line, http=None))
        self.gateway = Program("run", "-c", str(file))

    def __enter__(self):
        self.gateway.log.wait_for("line up")
        return self

    def __exit__(self, *_):
        self.gateway.stop()
        super().__exit__()

    def start_load(self, *options):
        port = str(self.gateway.modbus_port())
        return subprocess.Popen([self.tools["mbload"], "--port", port, *map(str, options)],
                                stdout=subprocess.PIPE, text=True)

    def load(self, *options):
        """What mbload saw, and what the bus saw meanwhile (its warm-up included)."""
        self.tell("reset")
        with self.start_load(*options) as load:
            seen = json.loads(load.communicate()[0])
        return seen, self.stats()


def wrong_values(seen):
    return sum(seen["mismatch"].values())


def utilisation(tools, folder, baud, seconds=4, echo=0):
    """(share of the wire's limit, gap violations, collisions) with eight clients. `echo`: the
    adapter hears itself (1)."""
    with Bus(tools, folder, baud, echo=echo) as bus:
        seen, wire = bus.load("--conns", 8, "--units", "1-8", "--time", seconds, "--warm", 1)
    return seen["all"]["tps"] / wire_limit(baud), wire["gap_violations"], wire["collisions"]


def with_dead(tools, folder, baud, dead, seconds=8, timeout=0.5):
    """(share of the wire's limit for the healthy ones, p99 in ms of the answers for the dead ones)."""
    faults = [f"{i}:drop=1" for i in range(9 - dead, 9)]
    settings = {"timing": f"{{response_timeout: {round(timeout * 1000)}ms}}"}
    with Bus(tools, folder, baud, faults, settings) as bus:
        # The warm-up is long enough for three silent transactions of each dead one, which have a
        # fifth of the line together.
        seen, _ = bus.load("--conns", 8, "--units", "1-8", "--live", f"1-{8 - dead}",
                           "--time", seconds, "--warm", 3 * timeout * dead / 0.2 + 2)
    return seen["live"]["tps"] / wire_limit(baud), seen["dead"]["lat_ms"]["p99"]


def shared(tools, folder, baud, clients, seconds=4):
    """(answers a second as a multiple of the wire's limit, answers a transaction on the wire)."""
    with Bus(tools, folder, baud) as bus:
        # Warm from the first request on, so that both sides count the same time.
        seen, wire = bus.load("--conns", clients, "--units", "1", "--addr", 100, "--time", seconds,
                              "--warm", 0)
    return seen["all"]["tps"] / wire_limit(baud), seen["all"]["ok"] / max(1, wire["replies"])


FAULTS = ("1:delay=50,delayto=140,delayevery=3", "2:delay=60,delayto=180,delayevery=4", "3:dup=3",
          "4:foreign=3", "5:crc=4", "6:noise=3", "7:trunc=4", "8:drop=6")


def under_faults(tools, folder, baud, seconds=10):
    """(good answers, wrong values, gap violations) with every fault of the bus on."""
    settings = {"timing": "{response_timeout: 100ms}", "queue": "{deadline: 4s}"}
    with Bus(tools, folder, baud, FAULTS, settings) as bus:
        seen, wire = bus.load("--conns", 16, "--units", "1-8", "--mix", "--time", seconds, "--warm", 0)
    return seen["all"]["ok"], wrong_values(seen), wire["gap_violations"]


# The same faults on a short response timeout: replies come in time, late, and in the quarantine.
QUICK_FAULTS = ("1:delay=5,delayto=14,delayevery=3", "2:delay=6,delayto=18,delayevery=4", *FAULTS[2:])


def many_under_faults(tools, folder, baud, transactions):
    """(transactions, good answers, wrong values) of one line with every fault on."""
    settings = {"timing": "{response_timeout: 10ms}", "queue": "{deadline: 4s}",
                "offline": "{probe_min: 10ms, probe_max: 20ms}"}
    sent = good = wrong = 0
    with Bus(tools, folder, baud, QUICK_FAULTS, settings) as bus:
        while sent < transactions:
            seen, wire = bus.load("--conns", 16, "--units", "1-8", "--mix", "--time", 20, "--warm", 0)
            sent += wire["frames"]
            good += seen["all"]["ok"]
            wrong += wrong_values(seen)
    return sent, good, wrong


def print_many(tools, folder, baud, transactions, lines):
    """Shares the transactions out to several lines, each with its own bus and gateway."""
    began = time.monotonic()
    with concurrent.futures.ThreadPoolExecutor(lines) as pool:
        share = -(-transactions // lines)
        runs = [pool.submit(many_under_faults, tools, folder, baud, share) for _ in range(lines)]
        sent, good, wrong = map(sum, zip(*(run.result() for run in runs)))
    print(f"every fault on, {lines} lines at {baud} baud: {sent} transactions, {good} good answers, "
          f"{wrong} wrong values, {time.monotonic() - began:.0f} s", flush=True)
    return wrong


def print_table(tools, folder):
    print("baud    of the limit  one dead  three dead  64 equal readers  wrong values of")
    for baud in RATES:
        used, violations, _ = utilisation(tools, folder, baud)
        one, _ = with_dead(tools, folder, baud, 1)
        three, _ = with_dead(tools, folder, baud, 3)
        times, _ = shared(tools, folder, baud, 64)
        good, wrong, more = under_faults(tools, folder, baud)
        print(f"{baud:<7} {used:<13.3f} {one:<9.3f} {three:<11.3f} {times:<17.1f} {wrong} of {good}"
              f"{'' if violations + more == 0 else f'  {violations + more} gap violations'}", flush=True)


MEASURES = {  # what is compared: seconds of each are what a loss of 0.5 % needs to show
    "utilisation": lambda *where: utilisation(*where, seconds=6)[0],
    "one dead": lambda *where: with_dead(*where, 1)[0],
    "three dead": lambda *where: with_dead(*where, 3)[0],
    "64 equal readers": lambda *where: shared(*where, 64)[0],
}


def print_comparison(tools, folder, other, repeat):
    """Each measure of this program and of `other`, turn and turn about; medians."""
    programs = (other, harness.PANELGATE)
    print(f"medians of {repeat}\nbaud    measure           the other  this one  ratio")
    for baud in RATES:
        for name, measure in MEASURES.items():
            seen = ([], [])
            for turn in range(2 * repeat):
                harness.PANELGATE = programs[turn % 2]
                seen[turn % 2].append(measure(tools, folder, baud))
            before, now = map(statistics.median, seen)
            print(f"{baud:<7} {name:<17} {before:<10.3f} {now:<9.3f} {now / before:.4f}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tools", nargs="?", type=pathlib.Path, default=TOOLS)
    parser.add_argument("--transactions", type=int, metavar="N",
                        help="instead of the table: N transactions with every fault on (P1)")
    parser.add_argument("--baud", type=int, default=57600,
                        help="of these transactions (%(default)s; above it the second copy of a reply "
                             "comes when the next one is due, and cannot be told apart)")
    parser.add_argument("--lines", type=int, default=16, help="that share them (%(default)s)")
    parser.add_argument("--against", metavar="PROGRAM",
                        help="instead of the table: beside another panelgate, in turns")
    parser.add_argument("--repeat", type=int, default=3, help="turns of each (%(default)s)")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        tools = build_tools(folder, options.tools)
        if tools is None:
            sys.exit(f"wire.py: there is no rtubus.cpp and mbload.cpp in {options.tools}")
        print(f"{platform.machine()}, {os.cpu_count()} cores, Linux {platform.release()}, "
              f"{datetime.date.today()}")
        if options.against:
            print_comparison(tools, folder, options.against, options.repeat)
        elif options.transactions is None:
            print_table(tools, folder)
        elif print_many(tools, folder, options.baud, options.transactions, options.lines):
            sys.exit(1)


if __name__ == "__main__":
    main()
