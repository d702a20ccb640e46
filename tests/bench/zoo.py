#!/usr/bin/env python3
"""What one odd panel of five costs the four healthy ones, habit by habit.

For each habit and rate: transactions a second of the healthy four and their times, with one client a
panel, beside the same line without the habit and a plain libmodbus master on an identical line.
Everything but the serial format (8N1) is the gateway's default, and the deadline at 1200 baud, where
five reads take 1.5 of its 2 s without any habit. Fails when a value was wrong, when a
read of a healthy panel was refused, when p90 of one is not below three times what it was without the
habit, when they lose more than a fifth of the line (where the odd one is only slow: beyond the time
that it takes), or when a plain master serves them more often.
"""
import argparse
import asyncio
import datetime
import json
import os
import pathlib
import platform
import subprocess
import sys
import tempfile
import time
from collections import namedtuple

HERE = pathlib.Path(__file__).resolve()
sys.path.insert(0, str(HERE.parents[1] / "system"))
import harness  # noqa: E402
import zoo_line  # noqa: E402
from clients import Client  # noqa: E402
from harness import write_register  # noqa: E402

PLAIN_MASTER = os.environ.get("PLAIN_MASTER", str(harness.ROOT / "build/release/plain_master"))
RATES = (1200, 9600, 38400, 115200, 921600)
UNITS, ODD = range(1, 6), 3
THINK = 1  # ms, of the healthy ones
TIMES = 3  # p90 stays below so many of what it was

# What has a habit; for how many seconds of a round of all five, and for how many characters, the line
# is rightly held by it; lossy: what is damaged by chance, so that a read may fail twice; alone: the
# only panel of its line; plain: how much of a plain master's rate it must be at least, less where
# chance decides how long replies take, 0 where it has another line (broadcasts, habits that change).
NOISE, CHANCE = 0.95, 0.75  # both are measured on a shared machine
Row = namedtuple("Row", "who slow characters lossy alone plain",
                 defaults=(0.0, 0, False, False, NOISE))
HOLES = 0.018 * 24  # between 25 bytes
REPLY = 25
ROWS = {
    "think-0.1ms": Row(ODD), "think-20ms": Row(ODD, 0.02), "think-450ms": Row(ODD, 0.45),
    "think-2000ms": Row(ODD), "think-rand-0.1-400": Row(ODD, 0.4, plain=CHANCE),
    "slow-then-quick": Row(ODD, 0.04, plain=0), "quick-then-slow": Row(ODD, 0.04, plain=0),
    "every5-200x3": Row(ODD, 0.5), "holes-0-18": Row(ODD, HOLES, plain=CHANCE),
    "holes-all-0-18": Row("all", 5 * HOLES, plain=CHANCE), "usb16": Row("all", 5 * 0.016),
    "stall": Row("all", 0.4, plain=CHANCE), "pre-00-all": Row("all", 0, 5), "post-FF-all": Row("all", 0, 5),
    "pregap-00-all": Row("all", 5 * 0.003, 5), "tail-all": Row("all", 5 * 0.007, 15),
    "tail": Row(ODD, 0.007, 3), "echo-full": Row("all"), "echo-first": Row("all"),
    "echo-last": Row("all"), "echo-cutlast": Row("all"), "echo-biterr:5": Row("all", 0, 8),
    "echo-partial-3": Row("all"),
    "echo-partial-3,think-30ms": Row("all", 0.15, alone=True),
    "echo-partial-6,think-30ms": Row("all", 0.15, alone=True),
    "crcswap": Row(ODD), "bcast-reply": Row(ODD, plain=0), "babble-5000": Row(ODD, lossy=True),
    "babble-100": Row(ODD, lossy=True), "master-other-polite": Row(ODD, lossy=True),
    "reboot": Row(ODD), "mute": Row(ODD), "dead": Row(ODD), "dup-5ms": Row(ODD, 0.007, REPLY),
    "dup-300ms": Row(ODD, 0.3, REPLY), "noise-1000": Row("all", lossy=True),
    "pad2": Row(ODD, 0, 2), "padin2": Row(ODD, 0, 2), "excfn-84": Row(ODD),
    "twin-1-30": Row(ODD, 0.032, REPLY), "rate+2": Row(ODD), "rate-2": Row(ODD),
}

Seen = namedtuple("Seen", "rate p50 p90 p95 wrong refused odd")
Seen.__doc__ = """Of the healthy: good answers a second, seconds (p90, p95: of the slowest panel), exceptions.
`wrong`: by unit; `odd`: what the odd one's client got."""


def settings_of(name):
    """What zoo_bus is told: who has it is in the table."""
    who, habits = ROWS[name].who, name.replace("-all", "")
    return {"all": f"think-{THINK}ms,{habits}"} if who == "all" else {who: habits}


def units_of(name):
    return [ODD] if name and ROWS[name].alone else UNITS


def options():
    return ("--think", THINK)


def keys(baud):
    return {"queue": "{deadline: 10s}"} if baud <= 1200 else {}


async def broadcast(port, end):
    """Once a second, so that who answers broadcasts has some to answer."""
    client = await Client.connect(port)
    try:
        while time.monotonic() < end:
            await asyncio.sleep(1)
            await client.ask(0, write_register(zoo_line.WRITABLE, 1))
    finally:
        client.close()


def seen_of(readers, since, seconds):
    parts = {unit: reader.summary(since, since + seconds) for unit, reader in readers.items()}
    others = [s for unit, s in parts.items() if unit != ODD] or list(parts.values())
    healthy = zoo_line.merged(others)
    wrong = {unit: s.wrong for unit, s in parts.items() if s.wrong}
    odd = {**parts[ODD].refused, "good": parts[ODD].good}
    return Seen(healthy.good / seconds, healthy.quantile(0.5),
                *(max(s.quantile(q) for s in others) for q in (0.9, 0.95)),
                wrong, healthy.refused, odd)


def through_gateway(baud, name, seconds, warm):
    """Seen, and what the line doctor said; `name` None: without any habit."""
    units, habits = units_of(name), settings_of(name) if name else {}
    with zoo_line.odd_line(baud, units, habits, zoo=options(), **keys(baud)) as line:
        port = line.program.modbus_port()
        beside = (lambda end: broadcast(port, end)) if name == "bcast-reply" else None
        since = time.monotonic() + warm
        readers = asyncio.run(zoo_line.read_all(port, units, warm + seconds, beside=beside))
        found = line.program.get("/api/v1/lines/zoo")[1].get("findings", [])
    return seen_of(readers, since, seconds), findings(found)


def findings(found):
    return ", ".join(sorted({f["cause"] for f in found})) or "-"


def by_plain_master(baud, name, seconds):
    """Transactions a second of the healthy four, asked in turn by libmodbus."""
    with tempfile.TemporaryDirectory() as folder:
        arguments = [*options(), "--baud", baud, "--bus", f"{folder}/tty=1-5"]
        for who, names in settings_of(name).items():
            arguments += ["--set", f"{who}={names}"]
        with zoo_line.Zoo(*arguments) as zoo:
            command = [PLAIN_MASTER, zoo.names[0], str(baud), str(len(UNITS)), str(seconds)]
            ended = subprocess.run(command, capture_output=True, text=True, check=True,
                                   timeout=seconds + harness.PATIENCE)
    seen = json.loads(ended.stdout)
    good = sum(u["good"] for unit, u in seen["units"].items() if int(unit) != ODD)
    return good / seen["seconds"]


def least_rate(baud, name, base):
    """What a line gives that loses no more than a fifth to a panel, and what that rightly takes."""
    row = ROWS[name]
    round_time = (len(UNITS) - 1) / base.rate
    held = row.slow + row.characters * 10 / baud
    return 0.75 * base.rate * round_time / (round_time + held)


def faults(baud, name, base, seen, plain):
    """Which bars this row breaks."""
    row, broken = ROWS[name], []
    if seen.wrong:
        broken.append(f"wrong values {seen.wrong}")
    if seen.refused and not row.lossy:
        broken.append(f"refused {seen.refused}")
    most = TIMES * base.p90 + row.slow
    if not seen.p90 < most:
        broken.append(f"p90 {1000 * seen.p90:.0f} ms, allowed {1000 * most:.0f}")
    least = 0 if row.lossy or row.alone else least_rate(baud, name, base)
    if seen.rate < least:
        broken.append(f"rate {seen.rate:.1f} of {base.rate:.1f}, at least {least:.1f}")
    if plain and seen.rate < row.plain * plain:
        broken.append(f"rate {seen.rate:.1f}, a plain master {plain:.1f}")
    return broken


HEAD = (f"{'baud':>7} {'habit':<26}{'rate/s':>9}{'plain/s':>9}"
        f"{'p50 ms':>9}{'p90 ms':>9}{'p95 ms':>9}  wrong, refused; of the odd one; findings")


def print_row(baud, name, seen, plain, said, broken):
    plain_text = "-" if plain is None else f"{plain:.1f}"
    print(f"{baud:>7} {name:<26}{seen.rate:>9.1f}{plain_text:>9}"
          f"{1000 * seen.p50:>9.1f}{1000 * seen.p90:>9.1f}{1000 * seen.p95:>9.1f}"
          f"  {seen.wrong or 0}, {seen.refused or 0}; {seen.odd}; {said}"
          f"{'' if not broken else '  FAILED: ' + '; '.join(broken)}", flush=True)


def measure_rate(baud, names, seconds, warm):
    """Rows that broke a bar. At least ten rounds are measured, and three before."""
    round_time = len(UNITS) * (8 + REPLY) * 10 / baud
    seconds, warm = max(seconds, 10 * round_time), max(warm, 3 * round_time)
    base, said = through_gateway(baud, None, seconds, warm)
    print_row(baud, "(none)", base, None, said, [])
    failed = []
    for name in names:
        seen, said = through_gateway(baud, name, seconds, warm)
        is_other_line = ROWS[name].alone or not ROWS[name].plain
        plain = None if is_other_line else by_plain_master(baud, name, seconds)
        broken = faults(baud, name, base, seen, plain)
        print_row(baud, name, seen, plain, said, broken)
        if broken:
            failed.append(name)
    return failed


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--panelgate", help="the program (default: $PANELGATE, else build/release)")
    parser.add_argument("--baud", type=int, nargs="+", default=RATES)
    parser.add_argument("--habits", nargs="+", choices=ROWS, default=list(ROWS), metavar="HABIT",
                        help=f"of {', '.join(ROWS)}")
    parser.add_argument("--seconds", type=float, default=6, help="of a measurement (%(default)s)")
    parser.add_argument("--warm", type=float, default=3, help="before it (%(default)s)")
    chosen = parser.parse_args()
    if chosen.panelgate:
        harness.PANELGATE = chosen.panelgate
    print(f"{platform.machine()}, {os.cpu_count()} cores, Linux {platform.release()}, "
          f"{datetime.date.today()}\n{HEAD}")
    failed = {baud: measure_rate(baud, chosen.habits, chosen.seconds, chosen.warm)
              for baud in chosen.baud}
    for baud, names in failed.items():
        if names:
            print(f"{baud}: {', '.join(names)}")
    sys.exit(any(failed.values()))


if __name__ == "__main__":
    main()
