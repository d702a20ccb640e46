"""A line of odd panels (tests/zoo) with the gateway on it, and clients that know every value."""
import asyncio
import concurrent.futures
import contextlib
import json
import os
import pathlib
import random
import struct
import subprocess
import sys
import tempfile
import time
from collections import namedtuple

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "bench"))
import config  # noqa: E402
import harness  # noqa: E402
from clients import Client, percentile, with_clients  # noqa: E402,F401
from harness import read_registers, write_register  # noqa: E402

ZOO_BUS = os.environ.get("ZOO_BUS", str(harness.ROOT / "build/release/zoo_bus"))
Line = namedtuple("Line", "zoo program")
Write = namedtuple("Write", "at unit pdu")
WRITABLE = 0x8000  # registers and coils from here on are written by tests, those below are not


def holding(unit, address):
    return (unit * 257 + address * 31 + 7) & 0xFFFF


def is_value(unit, pdu, reply):
    """Whether this is what the panel holds: of reads of holding registers that nobody writes, and
    of writes, that are confirmed by an echo of their head."""
    if pdu[0] != 3:
        return reply == pdu[:5]
    _, address, count = struct.unpack(">BHH", pdu)
    want = struct.pack(f">BB{count}H", 3, 2 * count,
                       *(holding(unit, a) for a in range(address, address + count)))
    return reply == want


class Zoo:
    """zoo_bus, running; `names`: its links, or its HOST:PORT."""

    def __init__(self, *arguments):
        self._process = subprocess.Popen([ZOO_BUS, *map(str, arguments)], stdin=subprocess.PIPE,
                                         stdout=subprocess.PIPE, text=True)
        ready = self._process.stdout.readline().split()
        assert ready[:1] == ["ready"], ready
        self.names = ready[1:]
        self.pid = self._process.pid

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.communicate("quit\n", harness.PATIENCE)

    def ask(self, command):
        self._process.stdin.write(command + "\n")
        self._process.stdin.flush()
        return self._process.stdout.readline().rstrip("\n")

    def tell(self, command):
        answer = self.ask(command)
        assert answer == "ok", (command, answer)

    def set(self, unit, habits):
        """`unit`: a number or "all"; `habits`: names with commas between, "-" for none."""
        self.tell(f"set {unit} {habits}")

    def stats(self, bus=0):
        return json.loads(self.ask(f"@{bus} stats"))

    def writes(self):
        """What panels have executed, in that order; `at`: time.monotonic() when it had come."""
        return [Write(at / 1e9, unit, bytes.fromhex(pdu))
                for at, unit, pdu in json.loads(self.ask("writes"))]


@contextlib.contextmanager
def odd_line(baud, units=range(1, 6), habits=None, tcp=False, zoo=(), wire_baud=None, others=(),
             **keys):
    """Panels and a gateway; `habits`: {unit or "all": names}; `zoo`: more options of zoo_bus;
    `wire_baud`: where it is not what the gateway thinks, 0: unpaced; `others`: more lines of the
    gateway; `keys`: of the line, also
    `stations` where more than their ids is to be said."""
    with tempfile.TemporaryDirectory() as folder:
        numbers = ",".join(map(str, units))
        far_end = "tcp:0" if tcp else f"{folder}/tty"
        pace = baud if wire_baud is None else wire_baud
        options = [*zoo, "--baud", pace, "--bus", f"{far_end}={numbers}"]
        for unit, names in (habits or {}).items():
            options += ["--set", f"{unit}={names}"]
        with Zoo(*options) as panels:
            device = f"tcp://{panels.names[0]}" if tcp else panels.names[0]
            keys = {"stations": config.station_ids(units), **keys}
            listener = config.MANY + (", lines: [zoo]" if others else "")
            listed = config.line("zoo", device, baud=baud, **keys)
            with harness.configured(config.gateway(listed, *others, modbus=listener)) as program:
                program.log.wait_for("line up")
                yield Line(panels, program)


class Reader:
    """Reads of one unit, one at a time, as SCADA does: values, refusals, wrong values and times."""

    def __init__(self, unit, seed=0, count=10):
        self.unit, self.count = unit, count
        self._dice = random.Random(1000 * seed + unit)
        self.asked = []
        self.done = False

    def request(self):
        return read_registers(self._dice.randrange(2000), self.count)

    async def read_until(self, client, end, pause=0.0):
        while time.monotonic() < end and not self.done:
            self.asked.append(await client.ask(self.unit, self.request()))
            if pause:
                await asyncio.sleep(pause)

    def summary(self, since=0.0, until=float("inf")):
        """Of what was answered then."""
        return Summary([a for a in self.asked if a.answered and since <= a.answered < until])


class Summary:
    def __init__(self, asked):
        self.seconds = [a.seconds for a in asked]
        self.good = sum(a.is_good and is_value(a.unit, a.pdu, a.reply) for a in asked)
        self.wrong = sum(a.is_good for a in asked) - self.good
        self.refused = {}
        for a in asked:
            if not a.is_good:
                self.refused[a.exception] = self.refused.get(a.exception, 0) + 1

    def quantile(self, share):
        return percentile(self.seconds, share) if self.seconds else float("inf")


def merged(summaries):
    total = Summary([])
    for one in summaries:
        total.seconds += one.seconds
        total.good += one.good
        total.wrong += one.wrong
        for code, count in one.refused.items():
            total.refused[code] = total.refused.get(code, 0) + count
    return total


async def read_all(port, units, seconds, readers=None, beside=None):
    """A reader of its own connection for each unit; `beside`: a coroutine function that runs with
    them, and is given the end. {unit: Reader}."""
    readers = readers or {unit: Reader(unit) for unit in units}
    clients = [await Client.connect(port) for _ in readers]
    end = time.monotonic() + seconds
    work = [r.read_until(c, end) for r, c in zip(readers.values(), clients)]
    if beside:
        work.append(beside(end))
    try:
        await asyncio.gather(*work)
    finally:
        for client in clients:
            client.close()
    return readers


def in_parallel(work, cases):
    """[work(case)], all at once: each has a line and a gateway of its own."""
    with concurrent.futures.ThreadPoolExecutor(len(cases)) as pool:
        return list(pool.map(work, cases))


def every_kind_of_write(turn):
    """05 06 15 16 in turn, to places that nobody else writes."""
    address = WRITABLE + 4 * turn
    return (struct.pack(">BHH", 5, address, 0xFF00 * (turn // 4 % 2)),
            write_register(address, turn),
            struct.pack(">BHHBB", 15, address, 8, 1, turn & 0xFF),
            struct.pack(">BHHBHH", 16, address, 2, 4, turn, turn + 1))[turn % 4]


def outcome(client, unit, pdu):
    """"good", "wrong", or the exception."""
    reply = client.ask(unit, pdu)
    if reply[0] & 0x80:
        return f"{pdu[0]:02}: exception {reply[1]:02X}"
    return "good" if is_value(unit, pdu, reply) else f"{pdu[0]:02}: wrong"


def counted(outcomes):
    return {kind: outcomes.count(kind) for kind in sorted(set(outcomes))}
