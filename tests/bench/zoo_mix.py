#!/usr/bin/env python3
"""Wrong values of a great many transactions, while panels are odd in ways that change all the time.

Several lines of five panels on one gateway, a client a panel; twice a second each line gets another
habit somewhere. Prints what came of it; fails when a value was wrong.
"""
import argparse
import asyncio
import collections
import contextlib
import datetime
import os
import pathlib
import platform
import random
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve()
sys.path.insert(0, str(HERE.parents[1] / "system"))
import config  # noqa: E402
import harness  # noqa: E402
import zoo  # noqa: E402
import zoo_line  # noqa: E402
from clients import Client  # noqa: E402

PANELS = 5  # of a line
PERIOD = 0.5  # s between two changes of a line
SILENT = {"mute", "dead", "reboot", "think-2000ms"}  # in the table; here only now and then


class Mix:
    """One gateway, its lines, and who changes them."""

    def __init__(self, folder, lines, baud, tcp, seed, names):
        self.lines, self._dice, self._names = range(lines), random.Random(seed), names
        self.habits = {}  # of a unit, as it is now
        command = ["--baud", baud, "--think", 1]
        for n in self.lines:
            command += ["--bus", f"{'tcp:0' if tcp else f'{folder}/tty{n}'}={self.range_of(n)}"]
        self.zoo = zoo_line.Zoo(*command)
        devices = [f"tcp://{name}" if tcp else name for name in self.zoo.names]
        self.text = config.gateway(*(
            config.line(f"line{n}", device, config.station_ids(self.units(n)), baud=baud)
            for n, device in zip(self.lines, devices)), modbus=config.MANY)

    def units(self, line):
        return range(line * PANELS + 1, line * PANELS + PANELS + 1)

    def range_of(self, line):
        return f"{self.units(line)[0]}-{self.units(line)[-1]}"

    def change(self, line):
        """Another habit for one panel of this line, or for all, or none any more."""
        name = self._dice.choice(self._names)
        if name in SILENT and self._dice.randrange(4):
            name = "think-0.1ms"
        who, habits = list(zoo.settings_of(name).items())[0]
        if who != "all":
            who = self._dice.choice(self.units(line))
        for unit in self.units(line) if who == "all" else [who]:
            self.set(line, unit, habits)
        for unit in self.units(line):
            if self._dice.randrange(3) == 0:
                self.set(line, unit, "-")

    def set(self, line, unit, habits):
        self.zoo.tell(f"@{line} set {unit} {habits}")
        self.habits[unit] = habits

    def asked(self):
        return sum(self.zoo.stats(line)["requests"] for line in self.lines)


def origin_of(asked, before):
    """Whose value a wrong one is: of which of this client's earlier requests, and what came of it."""
    unit, value = asked.unit, int.from_bytes(asked.reply[2:4], "big")
    address = (value - unit * 257 - 7) * pow(31, -1, 0x10000) & 0xFFFF
    for earlier in reversed(before):
        if int.from_bytes(earlier.pdu[1:3], "big") == address:
            came = "answered" if earlier.is_good else f"refused {earlier.exception:02X}"
            return f"{came}, asked {asked.answered - earlier.sent:.2f} s before"
    return "of nobody here"


async def run(mix, port, transactions):
    """([Reader], {habits of a panel: wrong values then}), when they have been asked so often."""
    readers = [zoo_line.Reader(unit) for line in mix.lines for unit in mix.units(line)]
    clients = [await Client.connect(port) for _ in readers]
    ended, wrong = asyncio.Event(), collections.Counter()

    async def read(reader, client):
        while not ended.is_set():
            asked = await client.ask(reader.unit, reader.request())
            reader.asked.append(asked)
            if asked.is_good and not zoo_line.is_value(asked.unit, asked.pdu, asked.reply):
                wrong[mix.habits.get(reader.unit, "-")] += 1
                print(f"  wrong: unit {asked.unit}, {mix.habits.get(asked.unit, '-')}: the value of "
                      f"one {origin_of(asked, reader.asked[:-1])}", flush=True)

    async def change():
        while mix.asked() < transactions:
            for line in mix.lines:
                mix.change(line)
            await asyncio.sleep(PERIOD)
        ended.set()
    await asyncio.gather(change(), *map(read, readers, clients))
    for client in clients:
        client.close()
    return readers, wrong


def measure(chosen, baud, transactions):
    """(transactions, Summary, wrong values by habit, seconds)"""
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        names = [name for name in zoo.ROWS if name not in chosen.without]
        mix = Mix(folder, chosen.lines, baud, chosen.tcp, chosen.seed, names)
        stack.enter_context(mix.zoo)
        program = stack.enter_context(harness.configured(mix.text))
        program.log.wait_for("line up", chosen.lines)
        start = time.monotonic()
        readers, wrong = asyncio.run(run(mix, program.modbus_port(), transactions))
        return (mix.asked(), zoo_line.merged(r.summary() for r in readers), dict(wrong),
                time.monotonic() - start)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--panelgate", help="the program (default: $PANELGATE, else build/release)")
    parser.add_argument("--transactions", type=int, default=100_000)
    parser.add_argument("--baud", type=int, nargs="+", default=[38400, 115200])
    parser.add_argument("--lines", type=int, default=16)
    parser.add_argument("--tcp", action="store_true", help="device servers instead of ttys")
    parser.add_argument("--without", nargs="+", default=[], choices=zoo.ROWS, metavar="HABIT")
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args()
    if chosen.panelgate:
        harness.PANELGATE = chosen.panelgate
    print(f"{platform.machine()}, {os.cpu_count()} cores, Linux {platform.release()}, "
          f"{datetime.date.today()}")
    wrong = 0
    for baud in chosen.baud:
        share = chosen.transactions // len(chosen.baud)
        asked, seen, by_habit, took = measure(chosen, baud, share)
        wrong += seen.wrong
        print(f"{chosen.lines} lines at {baud}{' over tcp' if chosen.tcp else ''}: {asked} "
              f"transactions, {seen.good} good answers, {seen.wrong} wrong values {by_habit or ''}, "
              f"refused {seen.refused}, {took:.0f} s", flush=True)
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
