#!/usr/bin/env python3
"""What forty hostile clients cost a busy line at 38400 baud, and how long /readyz takes beside them.

They send half of an ADU, garbage, headers without end or byte by byte, ask without a pause for the
status and for whatever is long (configuration, /openapi.json, /docs, /metrics), do not read, and come and go as often as they can: half of them on Modbus/TCP, half on HTTP,
none of them uses the line. Quiet and hostile times take turns, and in quiet ones the same clients
attack another gateway, so that both meet the same machine.
"""
import argparse
import asyncio
import contextlib
import datetime
import itertools
import os
import pathlib
import platform
import random
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve()
sys.path.insert(0, str(HERE.parents[1] / "system"))
import config  # noqa: E402
import harness  # noqa: E402
from harness import PATIENCE, adu, read_registers  # noqa: E402
from clients import percentile, with_clients  # noqa: E402
from zoo_line import odd_line  # noqa: E402

BAUD = 38400
UNITS = range(1, 6)
HOSTILE = 40
ADDRESSES = ["127.0.0.2", "127.0.0.3"]  # whose connections are hostile
PROBE_PAUSE = 0.02  # between two looks at /readyz
OWN_UNIT, OWN_REGISTERS = 255, 4  # answered without the line


class Enemy:
    """A hostile client: opens a connection, does its worst, and begins again when it is thrown
    out."""

    def __init__(self, seed, port):
        self.dice, self.port, self.done = random.Random(seed), port, 0
        self.own_address = ADDRESSES[seed % len(ADDRESSES)]

    async def run(self, deed, stop):
        while not stop.is_set():
            with contextlib.suppress(OSError, asyncio.IncompleteReadError):
                await self.connected(deed, stop)
            await asyncio.sleep(0)

    async def connected(self, deed, stop):
        reader, writer = await asyncio.open_connection("127.0.0.1", self.port,
                                                       local_addr=(self.own_address, 0))
        try:
            await deed(self, reader, writer, stop)
        finally:
            writer.transport.abort()  # a reset: as many ports as it takes

    async def until_closed(self, reader, stop):
        while not stop.is_set():
            with contextlib.suppress(asyncio.TimeoutError):
                if not await asyncio.wait_for(reader.read(65536), 0.2):
                    return

    async def storm(self, _reader, _writer, _stop):
        self.done += 1

    async def half(self, reader, writer, stop):
        writer.write(adu(1, 1, read_registers(0))[:9])
        self.done += 1
        await self.until_closed(reader, stop)

    async def garbage(self, reader, writer, stop):
        writer.write(self.dice.randbytes(self.dice.randrange(1, 600)))
        self.done += 1
        with contextlib.suppress(asyncio.TimeoutError):
            await asyncio.wait_for(reader.read(4096), 0.05)

    async def ask_own_unit(self, reader, writer, stop):
        """The gateway's own registers, 80 requests at a time."""
        request = b"".join(adu(n, OWN_UNIT, read_registers(0, OWN_REGISTERS)) for n in range(80))
        while not stop.is_set():
            writer.write(request)
            await reader.readexactly(80 * (9 + 2 * OWN_REGISTERS))
            self.done += 80

    async def never_read(self, _reader, writer, stop):
        writer.transport.pause_reading()
        request = b"".join(adu(n, OWN_UNIT, read_registers(0, OWN_REGISTERS)) for n in range(80))
        for _ in range(100):
            writer.write(request)
        self.done += 1
        while not stop.is_set() and not writer.is_closing():
            await asyncio.sleep(0.05)

    async def drip(self, _reader, writer, stop):
        writer.write(b"GET /api/v1/lines HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Slow: ")
        while not stop.is_set() and not writer.is_closing():
            writer.write(b"a")
            self.done += 1
            await asyncio.sleep(0.01)

    async def long_header(self, reader, writer, _stop):
        writer.write(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Long: " + b"a" * 200_000)
        self.done += 1
        await reader.read(4096)

    async def poll_status(self, reader, writer, stop):
        await self.ask_again_and_again(STATUS, reader, writer, stop)

    async def ask_what_is_long(self, reader, writer, stop):
        await self.ask_again_and_again(LONG, reader, writer, stop)

    async def ask_again_and_again(self, paths, reader, writer, stop):
        for path in itertools.cycle(paths):
            writer.write(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode())
            head = await reader.readuntil(b"\r\n\r\n")
            length = int(head.lower().split(b"content-length:")[1].split(b"\r\n")[0])
            await reader.readexactly(length)
            self.done += 1
            if stop.is_set():
                return


STATUS = ("/api/v1/lines", "/api/v1/stations", "/api/v1/lines/zoo", "/api/v1/relays")
LONG = ("/api/v1/configuration", "/openapi.json", "/metrics", "/docs")
MODBUS = (Enemy.storm, Enemy.half, Enemy.garbage, Enemy.ask_own_unit, Enemy.never_read)
HTTP = (Enemy.storm, Enemy.drip, Enemy.garbage, Enemy.long_header, Enemy.poll_status,
        Enemy.ask_what_is_long)


async def attack(modbus_port, http_port, kinds):
    """Until a line comes on stdin; tells what was done."""
    stop, enemies, tasks = asyncio.Event(), [], []
    deeds = [each for pair in itertools.zip_longest(((modbus_port, deed) for deed in MODBUS),
                                                    ((http_port, deed) for deed in HTTP))
             for each in pair if each and (not kinds or each[1].__name__ in kinds)]
    for n in range(HOSTILE):
        port, deed = deeds[n % len(deeds)]
        enemies.append((deed.__name__, Enemy(n, port)))
        tasks.append(asyncio.create_task(enemies[-1][1].run(deed, stop)))
    print("ready", flush=True)
    await asyncio.get_running_loop().run_in_executor(None, sys.stdin.readline)
    stop.set()
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
    done = {}
    for name, enemy in enemies:
        done[name] = done.get(name, 0) + enemy.done
    print(done, flush=True)


class Attack:
    """Hostile clients in a process of their own, for as long as the block lasts."""

    def __init__(self, program, kinds=()):
        self._process = subprocess.Popen(
            [sys.executable, "-B", str(HERE), "--attack", str(program.modbus_port()),
             str(program.http_port()), *kinds],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.done = {}

    def __enter__(self):
        self._process.stdout.readline()
        return self

    def __exit__(self, *_):
        told, _ = self._process.communicate("end\n", PATIENCE)
        self.done = told.strip()


def before_all_others(*processes):
    """These meet no others on the way to a processor, where that is allowed: hostile clients are on
    this machine only by chance, and so is whoever else works here."""
    for process in processes:
        with contextlib.suppress(PermissionError):
            os.sched_setscheduler(process, os.SCHED_RR | os.SCHED_RESET_ON_FORK, os.sched_param(1))


class Phase:
    def __init__(self):
        self.transactions, self.time, self.cpu = 0, 0.0, 0.0
        self.probes, self.failed, self.done = [], 0, ""

    @property
    def rate(self):
        return self.transactions / self.time


def cpu_seconds(process):
    """What it has used so far."""
    fields = pathlib.Path(f"/proc/{process}/schedstat").read_text().split()
    return int(fields[0]) / 1e9


async def probe(port, end, phase):
    """Looks at /readyz on a new connection each time, as an orchestrator does."""
    request = b"GET /readyz HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n"
    while time.monotonic() < end:
        start = time.monotonic()
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(request)
        answer = await reader.read()
        phase.probes.append(time.monotonic() - start)
        phase.failed += not answer.startswith(b"HTTP/1.1 200")
        writer.close()
        await asyncio.sleep(PROBE_PAUSE)


async def one_phase(line, clients, phase, seconds):
    """Busy to the brim: each client has four reads open, of several units."""
    dice = random.Random(1)
    zoo, end = line.zoo, time.monotonic() + seconds
    start, before = time.monotonic(), zoo.stats()["requests"]
    cpu = cpu_seconds(line.program.process.pid)
    await asyncio.gather(
        probe(line.program.http_port(), end, phase),
        *(c.ask_until(end, lambda: (dice.choice(UNITS), read_registers(dice.randrange(2000), 10)), 4)
          for c in clients))
    phase.transactions += zoo.stats()["requests"] - before
    phase.time += time.monotonic() - start
    phase.cpu += cpu_seconds(line.program.process.pid) - cpu
    for client in clients:
        phase.failed += sum(not a.is_good for a in client.asked)
        client.asked.clear()


def idle_lines(count):
    """Lines with 31 stations of 10 points each, which nobody asks: all that is shown of them is
    long."""
    return config.wide_lines(count, 31, 10, every="60min")


def measure(rounds=3, seconds=3.0, kinds=(), lines=0):
    """(quiet, hostile): a Phase each, which take turns. `lines`: idle ones besides."""
    quiet, hostile = Phase(), Phase()
    with odd_line(BAUD, tcp=True, others=idle_lines(lines)) as line, harness.demo() as other:
        before_all_others(0, line.zoo.pid, line.program.process.pid)
        for _ in range(rounds):
            for phase, attacked in ((quiet, other), (hostile, line.program)):
                with Attack(attacked, kinds) as attack_:
                    asyncio.run(with_clients(line.program.modbus_port(), 4,
                                             lambda c, p=phase: one_phase(line, c, p, seconds)))
                phase.done = attack_.done
    return quiet, hostile


def print_table(quiet, hostile):
    print(f"{'':<10}{'transactions/s':>15}{'of quiet':>10}{'/readyz p50':>13}{'p99':>8}{'max ms':>8}"
          f"{'CPU %':>8}{'failed':>8}")
    for name, phase in (("quiet", quiet), ("hostile", hostile)):
        ms = [1000 * s for s in phase.probes]
        print(f"{name:<10}{phase.rate:>15.2f}{phase.rate / quiet.rate:>10.3f}"
              f"{percentile(ms, 0.5):>13.2f}{percentile(ms, 0.99):>8.2f}{max(ms):>8.2f}"
              f"{100 * phase.cpu / phase.time:>8.1f}{phase.failed:>8}", flush=True)
    for name, phase in (("the other gateway", quiet), ("this one", hostile)):
        print(f"in the last round, with {name}: {phase.done}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=5, help="of a phase (%(default)s)")
    parser.add_argument("--kinds", nargs="*", default=(), help="only these, such as storm half")
    parser.add_argument("--lines", type=int, default=0,
                        help="with 31 stations of 10 points each, besides (%(default)s)")
    parser.add_argument("--attack", nargs="+", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.attack:
        modbus_port, http_port, *kinds = options.attack
        asyncio.run(attack(int(modbus_port), int(http_port), kinds))
        return
    print(f"{platform.machine()}, {os.cpu_count()} cores, Linux {platform.release()}, "
          f"{datetime.date.today()}")
    print_table(*measure(options.rounds, options.seconds, options.kinds, options.lines))


if __name__ == "__main__":
    main()
