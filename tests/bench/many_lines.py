#!/usr/bin/env python3
"""What bad lines cost the good ones: 32 lines in one process, of which one is mute, one full of
noise (1 MB/s) and one comes and goes.

TOOLS is a folder with rtubus.cpp and mbload.cpp (default: $PANELGATE_TOOLS, else ../shared/tools
beside this tree). The phases of a run take turns, so that all of them meet the same machine.
"""
import argparse
import asyncio
import contextlib
import datetime
import gc
import os
import pathlib
import platform
import random
import re
import subprocess
import sys
import tempfile
import threading
import time

HERE = pathlib.Path(__file__).resolve()
sys.path.insert(0, str(HERE.parents[1] / "system"))
import config  # noqa: E402
import wire  # noqa: E402
from clients import percentile, with_clients  # noqa: E402
from harness import PATIENCE, Program, read_registers  # noqa: E402
from rtu_bus import RtuBus, echo_address  # noqa: E402

BAUD = 38400
LINES = 32  # line n has the one station n
MUTE, FLAPPING, NOISY = 30, 31, 32
GOOD = range(1, 30)
PERIOD = 0.025  # of a line's client: about half of what the line can carry
FLAPS = 4  # a second
NOISE = 1_000_000  # bytes a second
ALL_BAD = ("mute", "noisy", "flapping")


class NoisyLine:
    """The line of station NOISY, in a process of its own: a good one until noise is switched on."""

    def __init__(self, link, piece):
        self._process = subprocess.Popen(
            [sys.executable, "-B", str(HERE), "--noisy-line", link, "--piece", str(piece)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self._process.stdout.readline()

    def tell(self, command):
        """Bytes a second since the last command."""
        self._process.stdin.write(command + "\n")
        self._process.stdin.flush()
        return float(self._process.stdout.readline())

    def end(self):
        self._process.communicate()


def write_noise(bus, piece, ended, sent):
    """NOISE bytes a second in pieces of this size, until `ended`; `sent` counts them."""
    noise = random.Random(1).randbytes(1 << 20)
    start = time.monotonic()
    while not ended.wait(piece / NOISE):
        due = int((time.monotonic() - start) * NOISE) - sent[0]
        for _ in range(due // piece):
            at = sent[0] % (len(noise) - piece)
            bus.inject(noise[at:at + piece])
            sent[0] += piece


def serve_noisy_line(link, piece):
    """What NoisyLine's process does: `on` and `off`, until stdin ends."""
    ended, sent, thread, since = threading.Event(), [0], None, time.monotonic()
    with RtuBus(link, {NOISY: echo_address}) as bus:
        print("ready", flush=True)
        for command in sys.stdin:
            if thread:
                ended.set()
                thread.join()
                ended.clear()
            print(sent[0] / (time.monotonic() - since), flush=True)
            sent, since, thread = [0], time.monotonic(), None
            if command.strip() == "on":
                thread = threading.Thread(target=write_noise, args=(bus, piece, ended, sent))
                thread.start()
        if thread:
            ended.set()
            thread.join()


class Plant:
    """All lines, and one gateway for them."""

    def __init__(self, tools, folder, piece=1000):
        links = {n: f"{folder}/line{n}-{id(self)}" for n in range(1, LINES + 1)}
        # Each reply in one piece, at its end: the machine is not what is measured.
        command = [tools["rtubus"], "--baud", str(BAUD), "--chunk", "256"]
        for n in range(1, NOISY):
            command += ["--bus", f"{links[n]}={n}"]
        self._bus = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                     text=True)
        self._bus.stdout.readline()
        self._noisy = NoisyLine(links[NOISY], piece)
        file = pathlib.Path(f"{folder}/many-{id(self)}.yaml")
        file.write_text(config.gateway(*(
            config.line(f"line{n}", link, config.station_ids([n]), baud=BAUD, parity="even",
                        timing="{response_timeout: 100ms}",
                        offline="{probe_min: 100ms, probe_max: 200ms}")
            for n, link in links.items())))
        self.gateway = Program("run", "-c", str(file))

    def __enter__(self):
        self.gateway.log.wait_for("line up", LINES)
        return self

    def __exit__(self, *_):
        self.gateway.stop()
        self._noisy.end()
        self._bus.communicate("quit\n")

    def _tell_bus(self, command):
        self._bus.stdin.write(command + "\n")
        self._bus.stdin.flush()
        return self._bus.stdout.readline()

    def _flap(self, ended):
        while not ended.wait(0.5 / FLAPS):
            self._tell_bus(f"unplug {FLAPPING - 1}")
            ended.wait(0.5 / FLAPS)
            self._tell_bus(f"replug {FLAPPING - 1}")

    @contextlib.contextmanager
    def bad(self, which, rates):
        """These lines are bad in the block; afterwards the noise that was made is in `rates`."""
        ended = threading.Event()
        flapping = threading.Thread(target=self._flap, args=(ended,))
        if "mute" in which:
            self._tell_bus(f"fault {MUTE}:drop=1")
        if "flapping" in which:
            flapping.start()
        if "noisy" in which:
            self._noisy.tell("on")
        try:
            yield
        finally:
            if "noisy" in which:
                rates.append(self._noisy.tell("off"))
            ended.set()
            if "flapping" in which:
                flapping.join()
            self._tell_bus(f"fault {MUTE}:")

    def count(self, metric, line):
        """What a counter of this line has come to, all its stations together."""
        pattern = rf'^panelgate_{metric}\{{[^}}]*line="line{line}"[^}}]*\}} (\S+)$'
        text = self.gateway.get("/metrics")[1]
        return sum(map(float, re.findall(pattern, text, re.MULTILINE)))

    def cpu_seconds(self):
        path = pathlib.Path(f"/proc/{self.gateway.process.pid}/stat")
        fields = path.read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


async def until_all_answer(clients):
    """Every line is a good one (again)."""
    async def good(client, station):
        while not (await client.ask(station, read_registers(0))).is_good:
            await asyncio.sleep(0.01)
    everybody = asyncio.gather(*(good(client, n) for n, client in enumerate(clients, 1)))
    await asyncio.wait_for(everybody, PATIENCE)


async def poll(client, station, end, dice):
    """Reads 10 registers once a period, or as often as the line can."""
    due = time.monotonic() + dice.random() * PERIOD
    while due < end:
        await asyncio.sleep(due - time.monotonic())
        await client.ask(station, read_registers(dice.randrange(2000), 10))
        due = max(due + PERIOD * (0.9 + 0.2 * dice.random()), time.monotonic())


class Phase:
    """Pooled samples of the good lines, in seconds, and what the gateway used for them."""

    def __init__(self):
        self.seconds, self.failed, self.cpu, self.time = [], 0, 0.0, 0.0
        self.noise = []  # bytes a second, as written
        self.discarded, self.reopens = 0, 0  # what the gateway counted of it, and of the flaps

    def summary(self):
        ms = [1000 * s for s in self.seconds]
        return (percentile(ms, 0.5), percentile(ms, 0.99), max(ms))


async def one_phase(plant, clients, which, seconds, phase, dice):
    await until_all_answer(clients)
    for client in clients:
        client.asked.clear()
    phase.discarded -= plant.count("discarded_bytes_total", NOISY)
    phase.reopens -= plant.count("line_reopens_total", FLAPPING)
    with plant.bad(which, phase.noise):
        cpu, start = plant.cpu_seconds(), time.monotonic()
        end = start + seconds
        polls = [asyncio.create_task(poll(client, n, end, dice))
                 for n, client in enumerate(clients, 1)]
        await asyncio.wait(polls[:len(GOOD)])
        phase.cpu += plant.cpu_seconds() - cpu
        phase.time += time.monotonic() - start
    await asyncio.gather(*polls)
    phase.discarded += plant.count("discarded_bytes_total", NOISY)
    phase.reopens += plant.count("line_reopens_total", FLAPPING)
    for n in GOOD:
        asked = clients[n - 1].asked
        phase.seconds += [a.seconds for a in asked]
        phase.failed += sum(not a.is_good for a in asked)


def measure(tools, folder, kinds, rounds=3, seconds=3, piece=1000):
    """{bad lines: Phase} for each of `kinds`, which take turns, `rounds` times."""
    phases = {which: Phase() for which in kinds}
    dice = random.Random(1)

    async def work(clients):
        for _ in range(rounds):
            for which, phase in phases.items():
                await one_phase(plant, clients, which, seconds, phase, dice)

    gc.disable()  # its pauses would be the clients' longest times
    try:
        with Plant(tools, folder, piece) as plant:
            asyncio.run(with_clients(plant.gateway.modbus_port(), LINES, work))
    finally:
        gc.enable()
    return phases


def print_table(phases):
    base = phases[()].summary()
    print(f"{'bad lines':<24}{'requests':>9}{'p50 ms':>9}{'p99 ms':>9}{'max ms':>9}{'of good':>9}"
          f"{'CPU %':>8}{'MB/s':>7}{'reopens':>9}")
    for which, phase in phases.items():
        p50, p99, most = phase.summary()
        noise = f"{min(phase.noise) / 1e6:.2f}" if phase.noise else "-"
        print(f"{'+'.join(which) or 'none':<24}{len(phase.seconds):>9}{p50:>9.2f}{p99:>9.2f}"
              f"{most:>9.2f}{p99 / base[1]:>9.3f}{100 * phase.cpu / phase.time:>8.1f}{noise:>7}"
              f"{phase.reopens:>9.0f}"
              f"{'' if phase.failed == 0 else f'  {phase.failed} failed'}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tools", nargs="?", type=pathlib.Path, default=wire.TOOLS)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=3, help="of a phase (%(default)s)")
    parser.add_argument("--piece", type=int, default=1000,
                        help="bytes that the noise comes in (%(default)s)")
    parser.add_argument("--noisy-line", metavar="LINK", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.noisy_line:
        serve_noisy_line(options.noisy_line, options.piece)
        return
    with tempfile.TemporaryDirectory() as folder:
        tools = wire.build_tools(folder, options.tools)
        if tools is None:
            sys.exit(f"many_lines.py: there is no rtubus.cpp and mbload.cpp in {options.tools}")
        print(f"{platform.machine()}, {os.cpu_count()} cores, Linux {platform.release()}, "
              f"{datetime.date.today()}")
        kinds = [(), ("mute",), ("noisy",), ("flapping",), ALL_BAD]
        print_table(measure(tools, folder, kinds, options.rounds, options.seconds, options.piece))


if __name__ == "__main__":
    main()
