#!/usr/bin/env python3
"""How much of a paced RS-485 line the gateway uses: the figures behind promises P1, P4, P5 and P6.

usage: tests/bench/wire.py [TOOLS]

TOOLS is a folder with rtubus.cpp, an independent paced bus with faults, and mbload.cpp, a load
generator (default: $PANELGATE_TOOLS, else ../shared/tools beside this tree). Prints one table with
machine and date; all ratios come from one run on one machine.
"""
import datetime
import json
import os
import pathlib
import platform
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve()
sys.path.insert(0, str(HERE.parents[1] / "system"))
from harness import Program  # noqa: E402

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


class Bus:
    """rtubus with stations 1 to 8, and a gateway on it."""

    def __init__(self, tools, folder, baud, faults=(), settings=""):
        self.tools = tools
        link = f"{folder}/tty{baud}-{id(self)}"
        command = [tools["rtubus"], "--baud", str(baud), "--bus", f"{link}=1-8"]
        for fault in faults:
            command += ["--fault", fault]
        self.bus = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.bus.stdout.readline()
        stations = ", ".join(f"{{id: {i}}}" for i in range(1, 9))
        config = pathlib.Path(f"{link}.yaml")
        config.write_text(f"lines:\n  - name: wire\n    device: {link}\n"
                          f"    serial: {{baud: {baud}, parity: even}}\n{settings}"
                          f"    stations: [{stations}]\n"
                          "modbus_tcp: [{listen: '127.0.0.1:0'}]\n")
        self.gateway = Program("run", "-c", str(config))

    def __enter__(self):
        self.gateway.log.wait_for("line up")
        return self

    def __exit__(self, *_):
        self.gateway.stop()
        self.bus.communicate("quit\n")

    def tell(self, command):
        self.bus.stdin.write(command + "\n")
        self.bus.stdin.flush()
        return self.bus.stdout.readline()

    def load(self, *options):
        """What mbload saw, and what the bus saw meanwhile (its warm-up included)."""
        port = str(self.gateway.modbus_port())
        self.tell("reset")
        out = subprocess.run([self.tools["mbload"], "--port", port, *map(str, options)],
                             stdout=subprocess.PIPE, text=True, check=True).stdout
        return json.loads(out), json.loads(self.tell("stats"))[0]


def wrong_values(seen):
    return sum(seen["mismatch"].values())


def utilisation(tools, folder, baud, seconds=4):
    """(share of the wire's limit, gap violations, collisions) with eight clients."""
    with Bus(tools, folder, baud) as bus:
        seen, wire = bus.load("--conns", 8, "--units", "1-8", "--time", seconds, "--warm", 1)
    return seen["all"]["tps"] / wire_limit(baud), wire["gap_violations"], wire["collisions"]


def with_dead(tools, folder, baud, dead, seconds=8):
    """(share of the wire's limit for the healthy ones, p99 in ms of the answers for the dead ones)."""
    faults = [f"{i}:drop=1" for i in range(9 - dead, 9)]
    with Bus(tools, folder, baud, faults) as bus:
        # The warm-up is long enough for three silent transactions of each dead one.
        seen, _ = bus.load("--conns", 8, "--units", "1-8", "--live", f"1-{8 - dead}",
                           "--time", seconds, "--warm", 5 * dead + 1)
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
    settings = "    timing: {response_timeout: 100ms}\n    queue: {deadline: 4s}\n"
    with Bus(tools, folder, baud, FAULTS, settings) as bus:
        seen, wire = bus.load("--conns", 16, "--units", "1-8", "--mix", "--time", seconds, "--warm", 0)
    return seen["all"]["ok"], wrong_values(seen), wire["gap_violations"]


def main():
    tools_folder = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else TOOLS
    with tempfile.TemporaryDirectory() as folder:
        tools = build_tools(folder, tools_folder)
        if tools is None:
            sys.exit(f"wire.py: there is no rtubus.cpp and mbload.cpp in {tools_folder}")
        print(f"{platform.machine()}, {os.cpu_count()} cores, Linux {platform.release()}, "
              f"{datetime.date.today()}")
        print("baud    of the limit  one dead  three dead  64 equal readers  wrong values of")
        for baud in RATES:
            used, violations, _ = utilisation(tools, folder, baud)
            one, _ = with_dead(tools, folder, baud, 1)
            three, _ = with_dead(tools, folder, baud, 3)
            times, _ = shared(tools, folder, baud, 64)
            good, wrong, more = under_faults(tools, folder, baud)
            print(f"{baud:<7} {used:<13.3f} {one:<9.3f} {three:<11.3f} {times:<17.1f} {wrong} of {good}"
                  f"{'' if violations + more == 0 else f'  {violations + more} gap violations'}", flush=True)


if __name__ == "__main__":
    main()
