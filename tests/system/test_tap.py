"""A line whose master is somebody else: what the gateway tells of it is what was said there, and
nothing is ever sent. The tap is a second link of the zoo's wire, which hears both sides."""
import contextlib
import difflib
import json
import os
import pathlib
import random
import select
import struct
import subprocess
import tempfile
import termios
import threading
import time
import tty
import unittest
from collections import namedtuple

import config
import harness
from harness import read_registers, rtu, write_register
from zoo_line import ZOO_BUS, Zoo, is_value

PLAIN_MASTER = pathlib.Path(ZOO_BUS).with_name("plain_master")
TRANSACTIONS = int(os.environ.get("TAP_TRANSACTIONS", "800"))
FAULTS = {1: "mute@97,think-12ms@9", 2: "crcbad@83", 3: "dup-2ms@71,refuse-2@31",
          4: "padin2@89,post-FF@61", 5: "holes-0-8@5,pregap-00@67"}
Said = namedtuple("Said", "at kind frame")
Pair = namedtuple("Pair", "station request reply sure", defaults=[True])


def reply_size(pdu):
    return 5 + 2 * struct.unpack(">H", pdu[3:5])[0] if pdu[0] == 3 else 8


def has_reply(heard, station, size):
    """A good frame of this size, or an exception; a glitch may precede it."""
    return any(heard[at] == station and harness.crc(heard[at:at + n - 2]) == heard[at + n - 2:at + n]
               for n in (5, size) for at in range(len(heard) - n + 1))


class Master:
    """Another master: asks in turn, waits, goes on."""
    TIMEOUT = 0.5

    def __init__(self, path, seed=1):
        self._fd = os.open(path, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self._fd)
        self._dice = random.Random(seed)

    def close(self):
        os.close(self._fd)

    def request(self):
        address, value = self._dice.randrange(2000), self._dice.randrange(100)
        kind = self._dice.randrange(10)
        if kind == 0:
            return write_register(0x8000 + address, value)
        if kind == 1:
            return struct.pack(">BHHBHH", 16, 0x8000 + address, 2, 4, value, value)
        if kind == 2:
            return struct.pack(">BHH", 5, 0x8000 + address, 0xFF00)
        return read_registers(address, 1 + self._dice.randrange(20))

    def ask(self, station, pdu, timeout=None):
        """Bytes until a good reply is among them, or the time is over."""
        termios.tcflush(self._fd, termios.TCIFLUSH)
        os.write(self._fd, rtu(station, pdu))
        if station == 0:
            time.sleep(0.02)
            return b""
        want = reply_size(pdu)
        heard, end = b"", time.monotonic() + (timeout or self.TIMEOUT)
        while not has_reply(heard, station, want):
            left = end - time.monotonic()
            if left <= 0 or not select.select([self._fd], [], [], left)[0]:
                break
            heard += os.read(self._fd, 300)
        time.sleep(0.003)
        return heard

    def play(self, transactions, stations):
        for turn in range(transactions):
            broadcast = turn % 200 == 199
            self.ask(0 if broadcast else stations[turn % len(stations)],
                     write_register(0x9000, turn) if broadcast else self.request())


@contextlib.contextmanager
def tapped(habits, latency=0, points="", baud=115200):
    """A line with panels, its master's link, and a gateway that listens: (zoo, link, program, log)."""
    with tempfile.TemporaryDirectory() as folder:
        log = f"{folder}/log"
        options = ["--baud", baud, "--tap", f"{folder}/tap,{latency}", "--log", log, "--bus",
                   f"{folder}/master=1-5"]
        for unit, names in habits.items():
            options += ["--set", f"{unit}={names}"]
        with Zoo(*options) as zoo:
            stations = ", ".join(f"{{id: {i}, name: s{i}{points if i == 1 else ''}}}" for i in range(1, 6))
            line = config.line("tap", f"{folder}/tap", stations, baud=baud, mode="listen")
            with harness.configured(config.gateway(line, http=config.ADMIN)) as program:
                program.log.wait_for("line up")
                yield zoo, f"{folder}/master", program, log


class Listener:
    """All frames of the trace, fetched before they are forgotten."""

    def __init__(self, program):
        self._program = program
        self._next = 0
        self.frames = []

    def fetch(self):
        while True:
            status, page = self._program.get(f"/api/v1/lines/tap/trace?since={self._next}&last=500")
            assert status == 200, page
            told = sorted(page["frames"] + page["decisions"], key=lambda one: one["sequence"])
            numbers = [one["sequence"] for one in told] + [one["ended"] for one in page["transactions"]]
            if not numbers:
                return
            assert sorted(numbers) == list(range(self._next + 1, page["next"] + 1)), "some were lost"
            self._next = page["next"]
            self.frames += [(f.get("note", "doubt"), bytes.fromhex(f.get("bytes", ""))) for f in told]

    def pairs(self):
        made, asked = [], None
        for note, frame in self.frames:
            if note == "heard request":
                made.append(Pair(frame[0], frame[1:-2], None))
                asked = frame[0]
            elif note == "reply" and asked == frame[0]:
                made[-1] = made[-1]._replace(reply=frame[1:-2])
                asked = None
            elif note == "doubt" and made:
                made[-1] = made[-1]._replace(sure=False)
        # One in doubt without a reply is perhaps a copy of an echo.
        return [pair for pair in made if pair.sure or pair.reply]


def truth(log):
    """The pairs as the bus has logged them: no reply where it came damaged, or of another length."""
    made = []
    for line in pathlib.Path(log).read_text().splitlines():
        _, _, _, kind, *data = line.split()
        frame = bytes.fromhex("".join(data))
        if kind == "REQ":
            made.append(Pair(frame[0], frame[1:-2], None))
        elif kind == "RSP" and frame[0] == made[-1].station and made[-1].reply is None:
            frame = frame[:5 if frame[1] & 0x80 else reply_size(made[-1].request)]
            if harness.crc(frame[:-2]) == frame[-2:]:
                made[-1] = made[-1]._replace(reply=frame[1:-2])
    return made


def while_running(work, listener):
    """Runs it beside us, and fetches what is told meanwhile."""
    thread = threading.Thread(target=work)
    thread.start()
    while thread.is_alive():
        thread.join(1)
        listener.fetch()


def settled(listener, count):
    end = time.monotonic() + harness.PATIENCE
    while time.monotonic() < end:
        listener.fetch()
        if len(listener.pairs()) >= count:
            return


@unittest.skipIf(harness.SANITIZED, "a sanitizer takes the time that masters wait")
class Tap(unittest.TestCase):
    def check(self, zoo, log, listener, program, doubt_percent=3):
        known = truth(log)
        settled(listener, len(known))
        heard = listener.pairs()
        there, here = [p[:3] for p in known], [p[:3] for p in heard]
        differences = [change for change in
                       difflib.SequenceMatcher(None, there, here, autojunk=False).get_opcodes()
                       if change[0] != "equal"]
        missing = sum(max(b - a, d - c) for _, a, b, c, d in differences)
        wrong = [p for p in heard if p.sure and p.reply and p.reply[0] == 3 and not is_value(*p[:3])]
        stations = {i: program.get(f"/api/v1/stations/s{i}")[1]["heard"] for i in range(1, 6)}
        doubtful = sum(s["doubtful"] for s in stations.values())
        sent = zoo.stats()["tap_bytes"]
        print(f"\n  {len(known)} requests, {sum(p.reply is not None for p in known)} answered: "
              f"{missing} pairs differ, {len(wrong)} wrong values, {doubtful} in doubt, "
              f"{sent} bytes sent", end="")
        for _, a, b, c, d in differences[:3]:
            print(f"\n    on the bus {there[a:b]}, heard {here[c:d]}", end="")
        self.assertEqual((missing, wrong, sent), (0, [], 0))
        self.assertLess(doubtful * 100, doubt_percent * len(known))
        return stations

    def test_each_pair_of_another_master_is_found_among_faults(self):
        for latency in (0, 16):
            with self.subTest(latency=latency), tapped(FAULTS, latency) as (zoo, link, program, log):
                listener = Listener(program)
                master = Master(link)
                while_running(lambda: master.play(TRANSACTIONS, [1, 2, 3, 4, 5]), listener)
                master.close()
                stations = self.check(zoo, log, listener, program)
                self.assertGreater(stations[1]["timeouts"], 0)
                self.assertGreater(stations[2]["damaged"], 0)
                self.assertGreater(stations[3]["exceptions"], 0)
                self.assertGreater(stations[4]["replies"], 0)

    @unittest.skipUnless(PLAIN_MASTER.exists(), "libmodbus-dev is not here")
    def test_libmodbus_is_heard(self):
        with tapped({1: "mute@60", 2: "crcbad@50"}) as (zoo, link, program, log):
            listener = Listener(program)
            while_running(lambda: subprocess.run([PLAIN_MASTER, link, "115200", "5",
                                                  str(TRANSACTIONS / 190)],
                                                 stdout=subprocess.DEVNULL, check=True), listener)
            # All reads have one length: behind one that is not answered the replies of that panel
            # may be one behind for as long as this takes.
            self.check(zoo, log, listener, program, doubt_percent=25)

    def test_the_device_is_open_for_reading_only(self):
        with tapped({}) as (zoo, _, program, _log):
            modes = []
            for fd in pathlib.Path(f"/proc/{program.process.pid}/fd").iterdir():
                if "/dev/pts/" not in os.readlink(fd):
                    continue
                info = pathlib.Path(f"/proc/{program.process.pid}/fdinfo/{fd.name}").read_text()
                flags = int(info.split("flags:")[1].split()[0], 8)
                modes.append(flags & os.O_ACCMODE)
            self.assertEqual(modes, [os.O_RDONLY])


POINTS = (", points: [{name: level, at: 400101}, {name: total, at: 400103, type: u32}, "
          "{name: setpoint, at: 432769}]")


class Faces(unittest.TestCase):
    def test_points_tell_what_passed_by_with_its_age(self):
        with tapped({}, points=POINTS) as (_, link, program, _log):
            path = "/api/v1/stations/s1/points/"
            point = program.get(path + "level")[1]
            self.assertEqual((point["quality"], point["value"]), ("bad", None))
            master = Master(link)
            master.ask(1, read_registers(100, 4))
            master.ask(1, write_register(0x8000, 77))
            master.ask(2, read_registers(0))

            def become(name, value):
                end = time.monotonic() + harness.PATIENCE
                while time.monotonic() < end:
                    point = program.get(path + name)[1]
                    if point["value"] == value:
                        return point
                raise AssertionError((name, point))
            level = become("level", 257 + 100 * 31 + 7)
            self.assertEqual(level["quality"], "good")
            self.assertLess(level["age_ms"], 1000 * harness.PATIENCE)
            become("total", (257 + 102 * 31 + 7 << 16) + 257 + 103 * 31 + 7)
            become("setpoint", 77)
            self.assertEqual(program.get("/api/v1/stations/s1")[1]["state"], "heard")
            self.assertEqual(program.get("/api/v1/lines/tap")[1]["mode"], "listen")
            metrics = program.get("/metrics")[1]
            self.assertIn('panelgate_requests_total{line="tap",station="s1",function="6",'
                          'outcome="ok"} 1', metrics)
            self.assertIn('panelgate_turnaround_seconds_count{line="tap",station="s1"} 2', metrics)
            self.assertIn('panelgate_station_up{line="tap",station="s1"} 1', metrics)
            master.close()

    def test_requests_to_it_are_refused_and_nothing_is_sent(self):
        with tapped({}, points=POINTS) as (zoo, _, program, _log):
            with program.client() as client:
                self.assertEqual(client.ask(1, read_registers(0)), b"\x83\x0a")
                self.assertEqual(client.ask(1, write_register(0, 1)), b"\x86\x0a")
            for method, place, body in (
                    ("GET", "stations/s1/holding-registers/100", None),
                    ("PUT", "stations/s1/holding-registers/100", {"values": [1]}),
                    ("PUT", "stations/s1/points/level", {"value": 1}),
                    ("POST", "lines/tap/raw", {"station": 1, "pdu": "0300640001"}),
                    ("POST", "lines/tap/broadcast",
                     {"table": "holding-registers", "address": 1, "values": [1]})):
                status, problem = program.rest(method, "/api/v1/" + place, body)
                with self.subTest(method + " " + place):
                    self.assertEqual(status, 409, problem)
                    self.assertIn("listen", json.dumps(problem))
                    self.assertFalse(problem["transmitted"])
            self.assertEqual(zoo.stats()["tap_bytes"], 0)


if __name__ == "__main__":
    unittest.main()
