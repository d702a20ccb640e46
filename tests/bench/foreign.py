#!/usr/bin/env python3
"""How panelgate gets on with foreign slaves, beside a plain libmodbus master of the same slave.

Slaves: libmodbus, pymodbus and npm's modbus-serial, on a pseudo-terminal, unpaced and paced at 19200;
directly, and through ser2net and through socat as `tcp://`. The gateway has all defaults. Its client
and the plain master do the same: reads, 05 06 15 16, one at a time, in turns of a second each on one
line, so that the machine's moods cancel. Fails when a request through the gateway was not answered
well, or when its rate is below 0.95 of the plain master's. What is not installed is left out and said.

modbus-serial: `npm install --prefix FOLDER modbus-serial`, and --npm FOLDER or $MODBUS_SERIAL.
"""
import argparse
import contextlib
import datetime
import itertools
import json
import os
import pathlib
import platform
import re
import shutil
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections import Counter, namedtuple

HERE = pathlib.Path(__file__).resolve()
sys.path.insert(0, str(HERE.parents[1] / "system"))
import config  # noqa: E402
import harness  # noqa: E402
import zoo_line  # noqa: E402
from harness import Helper  # noqa: E402

BUILT = pathlib.Path(os.environ.get("FOREIGN_BUILT", harness.ROOT / "build/release"))
SOURCES = HERE.parent / "foreign"
BAUD, UNIT = 19200, 1
BAR = 0.95
PACES = {"unpaced": 0, "paced": BAUD}
PYTHON = "/usr/bin/python3" if os.access("/usr/bin/python3", os.X_OK) else sys.executable
SLAVES = {"libmodbus": [BUILT / "libmodbus_slave"],
          "pymodbus": [PYTHON, "-B", SOURCES / "pymodbus_slave.py"],
          "modbus-serial": ["node", SOURCES / "modbus_serial_slave.js"]}

Seen = namedtuple("Seen", "plain gateway ratio failed plain_failed findings")
Seen.__doc__ = "Good answers a second, the median of their ratios; what went wrong, by kind."


class Master(Helper):
    def __init__(self, *arguments):
        super().__init__([BUILT / "libmodbus_master", *arguments])
        self._runs = 0

    def run(self, seconds):
        """(good answers a second, Counter of what went wrong)"""
        self.process.stdin.write(f"{seconds}\n")
        self.process.stdin.flush()
        self._runs += 1
        seen = json.loads(self.out.wait_for("^{.*", self._runs).group())
        return seen["good"] / seen["seconds"], Counter(seen["failed"])


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as one:
        return one.getsockname()[1]


def wait_for_listener(port):
    """Without connecting: who serves one connection only would be busy with ours."""
    wanted = re.compile(rf":{port:04X} 0+:0+ 0A ")
    end = time.monotonic() + harness.PATIENCE
    while not wanted.search(pathlib.Path("/proc/net/tcp").read_text()):
        assert time.monotonic() < end, port
        time.sleep(0.01)


@contextlib.contextmanager
def directly(_, ttys):
    yield ttys


@contextlib.contextmanager
def by_ser2net(folder, ttys):
    ports = [free_port() for _ in ttys]
    file = pathlib.Path(folder) / "ser2net.yaml"
    file.write_text("%YAML 1.1\n---\n" + "".join(
        f"connection: &line{port}\n  accepter: tcp,127.0.0.1,{port}\n"
        f"  connector: serialdev,{tty},{BAUD}n81,local\n" for port, tty in zip(ports, ttys)))
    # It says on stderr that it finds no mDNS.
    with Helper(["ser2net", "-n", "-u", "-c", file], stderr=subprocess.DEVNULL):
        for port in ports:
            wait_for_listener(port)
        yield [f"127.0.0.1:{port}" for port in ports]


@contextlib.contextmanager
def by_socat(_, ttys):
    with contextlib.ExitStack() as stack:
        ends = []
        for tty in ttys:
            port = free_port()
            stack.enter_context(Helper(["socat", f"TCP-LISTEN:{port},bind=127.0.0.1,reuseaddr,fork",
                                        f"{tty},raw,echo=0,b{BAUD}"]))
            wait_for_listener(port)
            ends.append(f"127.0.0.1:{port}")
        yield ends


WAYS = {"direct": directly, "ser2net": by_ser2net, "socat": by_socat}


@contextlib.contextmanager
def line_of(slave, way, pace):
    """(what the gateway opens, what the plain master opens) of a line with that slave."""
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        far, *near = [f"{folder}/{name}" for name in ("slave", "gateway", "plain")]
        pair = stack.enter_context(Helper([BUILT / "serial_pair", PACES[pace], far, *near]))
        pair.out.wait_for("ready")
        served = stack.enter_context(Helper([*SLAVES[slave], far, BAUD, UNIT]))
        served.out.wait_for("ready")
        yield stack.enter_context(WAYS[way](folder, near))


def measure(slave, way, pace, phases, seconds):
    with line_of(slave, way, pace) as (ours, plain_end), contextlib.ExitStack() as stack:
        device = ours if ours.startswith("/") else f"tcp://{ours}"
        served = config.line("foreign", device, config.station_ids([UNIT]), baud=BAUD)
        program = stack.enter_context(harness.configured(config.gateway(served)))
        program.log.wait_for("line up")
        gateway = stack.enter_context(Master("tcp", f"127.0.0.1:{program.modbus_port()}", UNIT))
        plain = stack.enter_context(Master("rtu", plain_end, BAUD, UNIT))
        failed, plain_failed, pairs = Counter(), Counter(), []
        for _ in range(phases):
            rate, wrong = gateway.run(seconds)
            failed += wrong
            plain_rate, wrong = plain.run(seconds)
            plain_failed += wrong
            pairs.append((rate, plain_rate))
        found = program.get("/api/v1/lines/foreign")[1].get("findings", [])
    rates, plain_rates = zip(*pairs)
    ratio = statistics.median(a / b if b else float("inf") for a, b in pairs)
    return Seen(statistics.mean(plain_rates), statistics.mean(rates), ratio, dict(failed),
                dict(plain_failed), sorted({f["cause"] for f in found}))


def missing(slave, way):
    """Why this cannot be measured here, or None."""
    programs = [str(SLAVES[slave][0]), str(BUILT / "libmodbus_master")]
    programs += [] if way == "direct" else [way]
    for program in programs:
        if not shutil.which(program):
            return f"there is no {pathlib.Path(program).name}"
    probe = {"pymodbus": [PYTHON, "-c", "import pymodbus.server, serial_asyncio"],
             "modbus-serial": ["node", "-e", "require('modbus-serial')"]}.get(slave)
    if probe and subprocess.run(probe, capture_output=True, check=False).returncode != 0:
        return f"there is no {slave}"
    return None


def print_row(slave, way, pace, seen, broken):
    findings = ", ".join(seen.findings) or "-"
    print(f"{slave:<14}{way:<9}{pace:<9}{seen.plain:>9.1f}{seen.gateway:>9.1f}{seen.ratio:>7.3f}  "
          f"{seen.failed or 0}; plain: {seen.plain_failed or 0}; {findings}"
          f"{'  FAILED: ' + '; '.join(broken) if broken else ''}", flush=True)


def faults(seen):
    broken = []
    if seen.failed:
        broken.append(f"{sum(seen.failed.values())} not answered well")
    if seen.ratio < BAR:
        broken.append(f"{seen.ratio:.3f} of the plain master's rate")
    return broken


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--panelgate", help="the program (default: $PANELGATE, else build/release)")
    parser.add_argument("--slaves", nargs="+", choices=SLAVES, default=list(SLAVES))
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=list(WAYS))
    parser.add_argument("--paces", nargs="+", choices=PACES, default=list(PACES))
    parser.add_argument("--phases", type=int, default=8, help="of each of both (%(default)s)")
    parser.add_argument("--seconds", type=float, default=1, help="of a phase (%(default)s)")
    parser.add_argument("--npm", default=os.environ.get("MODBUS_SERIAL"), metavar="FOLDER",
                        help="where npm has installed modbus-serial")
    chosen = parser.parse_args()
    if chosen.panelgate:
        harness.PANELGATE = chosen.panelgate
    if chosen.npm:
        os.environ["NODE_PATH"] = str(pathlib.Path(chosen.npm).resolve() / "node_modules")
    print(f"{platform.machine()}, {os.cpu_count()} cores, Linux {platform.release()}, "
          f"{datetime.date.today()}\n"
          f"{'slave':<14}{'way':<9}{'pace':<9}{'plain/s':>9}{'ours/s':>9}{'ratio':>7}"
          "  what failed; findings")
    failed = 0
    for slave, way, pace in itertools.product(chosen.slaves, chosen.ways, chosen.paces):
        if reason := missing(slave, way):
            print(f"{slave:<14}{way:<9}{pace:<9} left out: {reason}")
            continue
        seen = measure(slave, way, pace, chosen.phases, chosen.seconds)
        broken = faults(seen)
        failed += bool(broken)
        print_row(slave, way, pace, seen, broken)
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
