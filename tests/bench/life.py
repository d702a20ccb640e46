#!/usr/bin/env python3
"""Ordinary life beside a plain bridge: what clients that wait one second get of a line of panels.

Two equal lines of the same panels, with the same small troubles: the gateway (all defaults) has the
one, a plain bridge (plain_bridge.py: it guards nothing) the other, and the same clients ask both the
same at the same instants. The bar, for each panel that is well: the gateway fails no more requests
than the bridge, but for what chance explains; its p99 is at most the bridge's plus one transaction;
no value is wrong. Ends with 1 where one is missed.

    life.py [--scene NAME ...] [--seconds N] [--seed N]
"""
import argparse
import asyncio
import contextlib
import datetime
import math
import os
import pathlib
import platform
import random
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field

HERE = pathlib.Path(__file__).resolve()
sys.path.insert(0, str(HERE.parents[1] / "system"))
import config  # noqa: E402
import harness  # noqa: E402
import zoo_line  # noqa: E402
from clients import Client, percentile  # noqa: E402
from harness import read_registers, write_register  # noqa: E402

PATIENCE = 1.0  # s that every client waits for an answer
UNITS = range(1, 9)
WRITABLE = zoo_line.WRITABLE
IGNORED = WRITABLE + 77  # a place whose writes are ignored, where a panel ignores any
# s behind a panel's return in which its own failures are nobody's: offline stations have 3 % of the line, and one
# probe is waited for as long as any request, 0.5 s.
RETURNING = 0.5 / 0.03 + 0.5
THINK = (5, 60)  # ms
TROUBLES = ("mute@120", "crcbad@150", "think-700@400")  # losses, damage and spikes of every panel


@dataclass
class Scene:
    """`habits`: of every panel, besides its think time; `ignores`: units that ignore writes to
    IGNORED; `off`: the unit that is off for a third of the time; `slack`: how much slower clients
    ask than usually; `once`: (unit, habit, seconds between): now and then the next reply has it."""
    baud: int = 38400
    tcp: bool = False
    units: range = UNITS
    habits: tuple = ()
    ignores: tuple = ()
    write_every: float = 2.0
    off: int = 0
    slack: float = 1.0
    once: tuple = ()


MIXED = {"habits": TROUBLES, "ignores": (4,), "off": 7}
SCENES = {
    "clean 38400": Scene(),
    "off and on 38400": Scene(off=7),
    "mixed 9600": Scene(9600, **MIXED, slack=2.0),
    "mixed 19200 tcp": Scene(19200, tcp=True, **MIXED, slack=1.5),
    "mixed usb 38400": Scene(**{**MIXED, "habits": (*TROUBLES, "usb")}, slack=1.5),
    "mixed 115200": Scene(115200, **MIXED),
    "mixed usb 115200 tcp": Scene(115200, tcp=True, **{**MIXED, "habits": (*TROUBLES, "usb")}),
    "loss 1 %": Scene(habits=("mute@100",)),
    "loss 3 %": Scene(habits=("mute@33",)),
    "loss 5 % tcp": Scene(tcp=True, habits=("mute@20",)),
    "one reply lost": Scene(units=range(1, 6), once=(2, "mute@=1", 5.0)),
    "one reply lost, alone, tcp": Scene(units=range(2, 3), tcp=True, once=(2, "mute@=1", 5.0),
                                        slack=1.5),
    "a write ignored each second": Scene(units=range(1, 6), ignores=(3,), write_every=1.0),
}


@dataclass
class Question:
    at: float
    kind: str
    unit: int
    pdu: bytes
    is_counted: bool = True  # it should succeed


ALL_ON, ONE_OFF = "all on", "one off"


@dataclass
class Seen:
    """Of one panel by one way, in a phase."""
    asked: int = 0
    failed: int = 0
    wrong: int = 0
    times: list = field(default_factory=list)  # s


def instants(period, seconds, start=0.0):
    return [start + n * period for n in range(int((seconds - start) / period))]


def questions(scene, seconds, seed):
    """What five kinds of clients ask, and when: someone who polls all, a historian with several
    requests in flight, an operator's screen, someone who writes, and one who reads for long."""
    dice, units, slack = random.Random(seed), list(scene.units), scene.slack
    asked = []

    def read(at, kind, unit):
        asked.append(Question(at, kind, unit, read_registers(dice.randrange(2000), 10)))
    for at in instants(1.5 * slack, seconds):
        for n, unit in enumerate(units):
            read(at + n * 1.5 * slack / len(units), "poller", unit)
    for at in instants(3.0 * slack, seconds, 0.7):
        for unit in dice.sample(units, min(4, len(units))):
            read(at, "historian", unit)
    for at in instants(1.0 * slack, seconds, 0.3):
        read(at, "screen", dice.choice(units))
    for at in instants(0.8 * slack, seconds, 0.11):
        read(at, "reader", units[len(units) // 3])
    for n, at in enumerate(instants(2.0 * slack, seconds, 0.55)):
        unit = dice.choice(units)
        asked.append(Question(at, "writer", unit, write_register(WRITABLE + n % 50, n)))
    for unit in scene.ignores:
        for n, at in enumerate(instants(scene.write_every, seconds, 0.2)):
            asked.append(Question(at, "heartbeat", unit, write_register(IGNORED, n), False))
    return sorted(asked, key=lambda question: question.at)


class Way:
    """The gateway's or the bridge's line: its panels, who is master there, and the clients."""

    def __init__(self, name, panels, port, scene):
        self.name, self.panels, self.port, self.scene = name, panels, port, scene
        self.seen = {}  # by phase and unit
        self._clients = {}

    async def connect(self, kinds):
        for kind in kinds:
            self._clients[kind] = await Client.connect(self.port)

    def close(self):
        for client in self._clients.values():
            client.close()

    async def ask(self, question, phase, is_off):
        asked = self._clients[question.kind].send(question.unit, question.pdu)
        with contextlib.suppress(asyncio.TimeoutError, asyncio.CancelledError):
            await asyncio.wait_for(asyncio.shield(asked.done), PATIENCE)
        reply = asked.reply
        if is_off or not question.is_counted:
            return
        seen = self.seen.setdefault(phase, {}).setdefault(question.unit, Seen())
        seen.asked += 1
        if reply is None or reply[0] & 0x80:
            seen.failed += 1
            seen.times.append(PATIENCE)
            return
        seen.times.append(asked.seconds)
        seen.wrong += not zoo_line.is_value(question.unit, question.pdu, reply)


def habits_of(scene, unit):
    names = [f"think-rand-{THINK[0]}-{THINK[1]}", *scene.habits]
    if unit in scene.ignores:
        names.append(f"ignore-{IGNORED}")
    return ",".join(names)


def events(scene, seconds):
    """(instant, unit or "all", habits to set): on both lines."""
    happens = []
    if scene.off:
        happens += [(seconds / 3, scene.off, "dead"),
                    (2 * seconds / 3, scene.off, habits_of(scene, scene.off))]
    if scene.once:
        unit, habit, period = scene.once
        happens += [(at, unit, f"{habits_of(scene, unit)},{habit}")
                    for at in instants(period, seconds, 2.0)]
    return sorted(happens)


def off_times(scene, seconds):
    """{unit: (from, to)}: what is asked of it then is not counted."""
    if scene.off:
        return {scene.off: (seconds / 3 - 1, 2 * seconds / 3 + RETURNING)}
    return {}


async def play(scene, ways, seconds, seed):
    asked = questions(scene, seconds, seed)
    off = off_times(scene, seconds)
    hours = list(off.values())
    for way in ways:
        await way.connect({question.kind for question in asked})
    loop = asyncio.get_running_loop()
    start = loop.time() + 0.2
    tasks = []

    async def happen():
        for at, unit, habits in events(scene, seconds):
            await asyncio.sleep(max(0.0, start + at - loop.time()))
            for way in ways:
                way.panels.set(unit, habits)
    happening = asyncio.create_task(happen())
    for question in asked:
        await asyncio.sleep(max(0.0, start + question.at - loop.time()))
        phase = ONE_OFF if any(begin <= question.at < end for begin, end in hours) else ALL_ON
        is_off = phase == ONE_OFF and question.unit in off
        for way in ways:
            tasks.append(asyncio.create_task(way.ask(question, phase, is_off)))
    await asyncio.gather(happening, *tasks)
    for way in ways:
        way.close()


@contextlib.contextmanager
def plain_bridge(device, baud):
    """Its port."""
    process = subprocess.Popen([sys.executable, "-B", str(HERE.with_name("plain_bridge.py")), device,
                                str(baud)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        yield int(process.stdout.readline())
    finally:
        process.communicate("end\n", harness.PATIENCE)


@contextlib.contextmanager
def panels_of(scene, folder, name, tcp):
    numbers = ",".join(map(str, scene.units))
    far_end = "tcp:0" if tcp else f"{folder}/{name}"
    with zoo_line.Zoo("--baud", scene.baud, "--bus", f"{far_end}={numbers}") as panels:
        for unit in scene.units:
            panels.set(unit, habits_of(scene, unit))
        yield panels


def run(scene, seconds, seed):
    """(gateway, bridge)"""
    with contextlib.ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        guarded = stack.enter_context(panels_of(scene, folder, "guarded", scene.tcp))
        plain = stack.enter_context(panels_of(scene, folder, "plain", False))
        device = f"tcp://{guarded.names[0]}" if scene.tcp else guarded.names[0]
        # Both know how long their clients wait.
        line = config.line("life", device, config.station_ids(scene.units), baud=scene.baud,
                           queue=f"{{deadline: {1000 * PATIENCE:.0f}ms}}")
        program = stack.enter_context(harness.configured(config.gateway(line)))
        program.log.wait_for("line up")
        port = stack.enter_context(plain_bridge(plain.names[0], scene.baud))
        ways = (Way("gateway", guarded, program.modbus_port(), scene),
                Way("bridge", plain, port, scene))
        asyncio.run(play(scene, ways, seconds, seed))
        return ways


def one_transaction(scene):
    """s: ten registers of a panel that thinks for long, and the silences."""
    return (8 + 25 + 8) * 10 / scene.baud + THINK[1] / 1000


def by_chance(failed):
    """So many failures more are no difference: twice the deviation of a count."""
    return failed + 1 + 2 * math.sqrt(failed)


def p99(panels):
    return percentile([t for seen in panels.values() for t in seen.times], 0.99)


def misses(scene, gateway, bridge):
    """Sentences on what misses the bar."""
    told = []
    for phase, panels in gateway.seen.items():
        plain = bridge.seen[phase]
        for unit, ours in panels.items():
            theirs = plain[unit]
            if ours.failed > by_chance(theirs.failed):
                told.append(f"{phase}: panel {unit} fails {ours.failed} of {ours.asked}, by the "
                            f"bridge {theirs.failed}")
            if ours.wrong:
                told.append(f"{phase}: panel {unit}: {ours.wrong} wrong values")
        if p99(panels) > p99(plain) + one_transaction(scene):
            told.append(f"{phase}: p99 {1000 * p99(panels):.0f} ms, by the bridge "
                        f"{1000 * p99(plain):.0f} ms")
    return told


def print_way(name, way):
    for phase, panels in way.seen.items():
        seen = panels.values()
        times = [t for one in seen for t in one.times]
        shares = sorted(1000 * one.failed / one.asked for one in seen)
        print(f"{name:<30}{phase:<9}{way.name:<8}{sum(one.asked for one in seen):>7}"
              f"{sum(one.failed for one in seen):>8}{shares[0]:>9.1f}{shares[-1]:>8.1f}"
              f"{1000 * percentile(times, 0.5):>8.0f}{1000 * percentile(times, 0.99):>7.0f}"
              f"{sum(one.wrong for one in seen):>7}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scene", action="append", choices=SCENES, metavar="NAME")
    parser.add_argument("--seconds", type=float, default=60, help="of a scene (%(default)s)")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    print(f"{platform.machine()}, {os.cpu_count()} cores, Linux {platform.release()}, "
          f"{datetime.date.today()}; {options.seconds:.0f} s a scene")
    print(f"{'':<47}{'asked':>7}{'failed':>8}{'best ‰':>9}{'worst ‰':>8}{'p50 ms':>8}{'p99':>7}"
          f"{'wrong':>7}")
    missed = []
    for name in options.scene or SCENES:
        gateway, bridge = run(SCENES[name], options.seconds, options.seed)
        print_way(name, gateway)
        print_way("", bridge)
        for told in misses(SCENES[name], gateway, bridge):
            missed.append(f"{name}: {told}")
            print(f"    missed: {told}", flush=True)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
