"""Replies that come in pieces, with up to 15 ms of silence between them, as USB adapters and busy
kernels deliver them: every length and every byte, without an error (pain: split frames)."""
import concurrent.futures
import contextlib
import pathlib
import random
import re
import struct
import sys
import tempfile
import unittest
from collections import namedtuple

import config
import harness
from harness import rtu
from rtu_bus import Pieces, RtuBus

STATIONS = (1, 3, 10, 13, 17, 19, 127, 247)  # one a line; bytes that terminals and parsers know
ROUNDS = 1 if harness.SANITIZED else 2
CASES = 240  # at a time, on all lines together
HOLE = 0.015  # seconds, the longest that is asked for
# A hole that the machine made longer is another test: after 20 ms without a byte a reply has ended.
TOO_LATE = 0.0185
ATTEMPTS = 5
BAUD = 115200
TROUBLE = ("retries", "late_frames", "foreign_frames", "damaged_frames", "echo_mismatch",
           "discarded_bytes")

Case = namedtuple("Case", "request reply data")  # PDUs; data: the reply's bytes that may be any


class Contents:
    """Random bytes; the first and the last of them take every value in turn."""

    def __init__(self, dice):
        self._dice = dice
        self._turn = 0

    def __call__(self, count):
        self._turn += 1
        data = bytearray(self._dice.randbytes(count))
        data[-1] = self._turn * 91 % 256
        data[0] = self._turn * 167 % 256
        return bytes(data)


def reads(contents, dice):
    """Every length that a reply with a byte count has: frames of 6 to 256 bytes."""
    for size in range(1, 252):
        for function, counts in ((1, range(8 * size - 7, 8 * size + 1)),
                                 (2, range(8 * size - 7, 8 * size + 1)),
                                 (3, [size / 2]), (4, [size / 2])):
            count = dice.choice(counts)
            if count == int(count) and count <= (2008 if function < 3 else 125):
                data = contents(size)
                yield Case(struct.pack(">BHH", function, dice.randrange(0x8000), int(count)),
                           bytes([function, size]) + data, data)


def writes(contents, dice):
    for count in range(1, 124):
        head = struct.pack(">BHH", 16, dice.randrange(0x8000), count)
        yield Case(head + bytes([2 * count]) + contents(2 * count), head, b"")
    for size in range(1, 247, 7):
        head = struct.pack(">BHH", 15, dice.randrange(0x8000), 8 * size)
        yield Case(head + bytes([size]) + contents(size), head, b"")
    for value in range(0, 256, 3):
        single = struct.pack(">BHBB", 6, dice.randrange(0x10000), value, 255 - value)
        yield Case(single, single, b"")


def others(contents, dice):
    """Everything else: user-defined ones of 4 to 256 bytes, whose end only silence tells."""
    for size in (0, 1, 2, 3, 40, 124, 125, 126, 127, 250, 251, 252):
        data = contents(size) if size else b""
        yield Case(bytes([65, 3]) + contents(3), bytes([65]) + data, data)
    for code in range(1, 256, 11):
        yield Case(struct.pack(">BHH", 3, dice.randrange(0x8000), 9), bytes([0x83, code]), b"")
    for size in (1, 20, 120):
        yield Case(bytes([17]), bytes([17, size]) + contents(size), b"")
        data = contents(2 * size)
        yield Case(struct.pack(">BHHHHB", 23, 1, size, 2, 2, 4) + contents(4),
                   bytes([23, 2 * size]) + data, data)
    objects = b"".join(bytes([i, size]) + contents(size) for i, size in enumerate((1, 60, 90)))
    yield Case(b"\x2b\x0e\x01\x00", b"\x2b\x0e\x01\x01\x00\x00\x03" + objects, b"")
    data = contents(62)
    yield Case(struct.pack(">BH", 24, 5), struct.pack(">BHH", 24, 64, 31) + data, data)
    mask = struct.pack(">B6s", 22, contents(6))
    yield Case(mask, mask, b"")
    yield Case(b"\x07", b"\x07" + contents(1), b"")
    yield Case(b"\x0b", b"\x0b" + contents(4), b"")


def cut(frame, dice):
    """[(silence, bytes)]: always a hole in the header and one before the CRC, the others anywhere;
    a short frame also byte by byte."""
    places = {dice.choice((1, 2)), len(frame) - 2}
    more = dice.choice((0, 1, 3, 8))
    anywhere = range(1, len(frame))
    if len(frame) <= 12 and more == 8:
        places.update(anywhere)
    else:
        places.update(dice.sample(anywhere, min(more, len(anywhere))))
    edges = [0, *sorted(places), len(frame)]
    return [(dice.uniform(0, HOLE), frame[a:b]) for a, b in zip(edges, edges[1:])]


def on_the_wire(frame):
    """Seconds that it takes there, with the silence behind it: no panel answers before."""
    return len(frame) * 10 / BAUD + 1.75e-3


class Line:
    """A panel that gives a list of replies in turn, and a client that knows them."""

    def __init__(self, number, station, cases):
        self.name, self.station = f"line{number}", station
        self.cases, self.pieces = zip(*cases)
        self.sent = []
        self.unexpected = []  # requests that did not arrive as they were sent

    def panel(self, frame):
        turn = len(self.sent)
        if turn == len(self.cases) or frame != rtu(self.station, self.cases[turn].request):
            self.unexpected.append(frame)
            return None
        (silence, first), *more = self.pieces[turn]
        self.sent.append(Pieces([(silence + on_the_wire(frame), first), *more]))
        return self.sent[-1]

    def ask_all(self, port):
        """Until an answer is wrong: [(case, answer)] of that."""
        with harness.Client(port) as client:
            for case in self.cases:
                answer = client.ask(self.station, case.request)
                if answer != case.reply:
                    return [(case, answer)]
        return []


def cases_of_a_round(seed):
    """[[(case, its pieces)] for each line], a part of them at a time."""
    dice = random.Random(seed)
    contents = Contents(dice)
    cases = [*reads(contents, dice), *writes(contents, dice), *others(contents, dice)]
    dice.shuffle(cases)
    for start in range(0, len(cases), CASES):
        part = cases[start:start + CASES]
        yield [[(case, cut(rtu(station, case.reply), dice)) for case in part[i::len(STATIONS)]]
               for i, station in enumerate(STATIONS)]


def trouble(metrics):
    """{metric of a line: count} where it is not 0."""
    pattern = rf"^panelgate_((?:{'|'.join(TROUBLE)})_total\{{.*\}}) (\S+)$"
    found = re.findall(pattern, metrics, re.MULTILINE)
    assert len(found) >= len(TROUBLE) * len(STATIONS), metrics
    return {name: float(value) for name, value in found if float(value)}


class Holes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        before = sys.getswitchinterval()
        sys.setswitchinterval(0.0005)  # the lines share an interpreter: none waits long for it
        cls.addClassCleanup(sys.setswitchinterval, before)

    def run_lines(self, lines):
        """Asks everything: (wrong answers, trouble in the metrics, the longest hole)."""
        with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
            configured = []
            for line in lines:
                link = pathlib.Path(folder) / line.name
                stack.enter_context(RtuBus(link, {line.station: line.panel}))
                configured.append(config.line(line.name, link, config.station_ids([line.station]),
                                              baud=BAUD, echo='"off"'))
            program = stack.enter_context(harness.configured(config.gateway(*configured)))
            program.log.wait_for("line up", len(lines))
            pool = stack.enter_context(concurrent.futures.ThreadPoolExecutor(len(lines)))
            port = program.modbus_port()
            wrong = sum(pool.map(lambda line: line.ask_all(port), lines), [])
            counted = trouble(program.get("/metrics")[1])
        return wrong, counted, max(pieces.longest for line in lines for pieces in line.sent)

    def without_trouble(self, cases):
        """The longest hole of it, in seconds."""
        for attempt in range(ATTEMPTS):
            lines = [Line(i, station, part)
                     for i, (station, part) in enumerate(zip(STATIONS, cases))]
            wrong, counted, longest = self.run_lines(lines)
            if longest <= TOO_LATE or not (wrong or counted):
                break
            print(f"\n  attempt {attempt + 1}: the machine made a hole of {1000 * longest:.1f} ms")
        self.assertEqual(wrong, [])
        self.assertEqual(counted, {})
        self.assertEqual([line.unexpected for line in lines], [[]] * len(lines))
        return longest

    def test_P1_holes_of_up_to_15_ms_anywhere_in_a_reply_are_no_error(self):
        for seed in range(1, ROUNDS + 1):
            parts = list(cases_of_a_round(seed))
            longest = max(map(self.without_trouble, parts))
            pieces = [pieces for part in parts for line in part for _, pieces in line]
            print(f"\n  {len(pieces)} replies in {sum(map(len, pieces))} pieces, no hole above "
                  f"{1000 * longest:.1f} ms", end="")

    def test_the_replies_have_every_length_and_every_byte_everywhere(self):
        lengths, first, last, before, behind = set(), set(), set(), set(), set()
        parts = (part for seed in range(1, ROUNDS + 1) for part in cases_of_a_round(seed))
        for line in (line for part in parts for line in part):
            for case, pieces in line:
                lengths.add(len(case.reply) + 3)
                if case.data:
                    first.add(case.data[0])
                    last.add(case.data[-1])
                before |= {data[-1] for _, data in pieces[:-1]}
                behind |= {data[0] for _, data in pieces[1:]}
        self.assertEqual(lengths, set(range(4, 257)))
        for place in (first, last, before, behind):
            self.assertEqual(place, set(range(256)))


if __name__ == "__main__":
    unittest.main()
