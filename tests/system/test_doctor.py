"""The line doctor: each trouble of a line is made, and its cause has to be in REST and in the log,
once."""
import contextlib
import itertools
import pathlib
import random
import re
import struct
import tempfile
import threading
import time
import unittest

import config
import harness
from harness import read_registers
from rtu_bus import Raw, RtuBus, echo_address

PATH = "/api/v1/lines/floor1"
NEEDED_GAP = 0.020  # seconds of silence that a slow panel needs before a request


def reply_of(frame, plus=0):
    """The right reply with its CRC; `plus`: of a panel with other values."""
    function, address, count = struct.unpack(">BHH", frame[1:6])
    values = [value + plus for value in range(address, address + count)]
    return harness.rtu(frame[0], struct.pack(f">BB{count}H", function, 2 * count, *values))


def flipped(data, at=3):
    return data[:at] + bytes([data[at] ^ 0x10]) + data[at + 1:]


class Line:
    """A program on a bus, and a client that asks both stations in turn."""

    def __init__(self, program, bus, client):
        self.program, self.bus, self.client = program, bus, client
        self.addresses = itertools.count(1)

    def ask_both(self, times=1):
        for _ in range(times):
            for station in (1, 2):
                self.client.ask(station, read_registers(next(self.addresses) % 1000, 4))

    def findings(self):
        status, body = self.program.get(PATH)
        assert status == 200, body
        return body["findings"]

    def until(self, is_there, drive=None):
        """Drives the line until the findings are so."""
        deadline = time.monotonic() + harness.PATIENCE
        while not is_there(findings := self.findings()):
            if time.monotonic() > deadline:
                raise AssertionError(f"{findings}\n{self.program.log.text()}")
            (drive or self.ask_both)()
        return findings


def configuration(link, mode):
    return config.gateway(config.line(
        device=link, stations="{id: 1, name: press}, {id: 2, name: oven}", baud=115200,
        parity="even", timing="{response_timeout: 60ms}", retries=1, echo=mode))


@contextlib.contextmanager
def line(panels, mode="auto", **options):
    with tempfile.TemporaryDirectory() as folder:
        link = pathlib.Path(folder) / "tty"
        with RtuBus(link, panels, **options) as bus, \
                harness.configured(configuration(link, mode)) as program:
            program.log.wait_for("line up")
            with program.client() as client:
                yield Line(program, bus, client)


class Doctor(unittest.TestCase):
    def said(self, program):
        """Ends the program; [(cause, station)] of the findings in its log."""
        program.stop()
        return re.findall(r"line finding line=floor1 cause=(\S+) station=(\S+)",
                          program.log.finished_text())

    def expect(self, running, cause, station=None, name="all", drive=None):
        found = running.until(bool, drive)
        (drive or running.ask_both)()
        found = running.findings()
        self.assertEqual([(f["cause"], f["station"]) for f in found], [(cause, station)], found)
        self.assertTrue(found[0]["text"] and found[0]["advice"] and found[0]["evidence"], found)
        status, body = running.program.get("/api/v1/lines")
        self.assertEqual((status, body["lines"][0]["findings"]), (200, [cause]))
        self.assertEqual(self.said(running.program), [(cause, name)])
        return found[0]

    def test_a_healthy_line_has_no_finding(self):
        with line({1: echo_address, 2: echo_address}) as running:
            self.assertEqual(running.findings(), [])
            running.ask_both(100)
            self.assertEqual(running.findings(), [])
            self.assertEqual(self.said(running.program), [])

    def test_nothing_is_heard_and_then_somebody_answers(self):
        plugged = threading.Event()

        def panel(frame):
            return echo_address(frame) if plugged.is_set() else None
        with line({1: panel, 2: panel}) as running:
            found = running.until(bool)
            self.assertEqual([f["cause"] for f in found], ["no-answer-at-all"])
            self.assertIn("115200 8E1", found[0]["advice"])
            plugged.set()
            running.until(lambda findings: not findings)
            gone = r"info line finding gone line=floor1 cause=no-answer-at-all station=all$"
            running.program.log.wait_for(gone)
            self.assertEqual(self.said(running.program), [("no-answer-at-all", "all")])

    def test_one_panel_that_is_off(self):
        with line({1: echo_address}) as running:
            self.expect(running, "station-silent", 2, "oven")

    def test_parity(self):
        def zeroed(frame):
            """8N2 on a line with even parity: what Linux makes of it."""
            return Raw(b if b.bit_count() % 2 else 0 for b in reply_of(frame))
        with line({1: zeroed, 2: zeroed}) as running:
            self.expect(running, "wrong-parity")

    def test_baud(self):
        chance = random.Random(1)

        def garbage(frame):
            return Raw(chance.choices(range(128, 256), k=2 * len(reply_of(frame))))
        with line({1: garbage, 2: garbage}) as running:
            self.expect(running, "wrong-baud")

    def test_sporadic_damage(self):
        def sporadic():
            seen = itertools.count(1)
            return lambda f: Raw(flipped(reply_of(f)) if next(seen) % 5 == 0 else reply_of(f))
        with line({1: sporadic(), 2: sporadic()}) as running:
            self.expect(running, "noise", drive=lambda: running.ask_both(20))

    def test_two_panels_with_one_address(self):
        seen = itertools.count()

        def both(frame):
            one, two = reply_of(frame), reply_of(frame, plus=7)
            if next(seen) % 3:
                return Raw(one + two)
            return Raw(a | b for a, b in zip(one + b"\0\0", b"\0\0" + two))
        with line({1: echo_address, 2: both}) as running:
            self.expect(running, "duplicate-address", 2, "oven",
                        drive=lambda: running.ask_both(10))

    def test_a_panel_that_needs_a_longer_gap(self):
        last = [0.0]

        def quick(frame):
            last[0] = time.monotonic()
            return echo_address(frame)

        def slow(frame):
            before, last[0] = last[0], time.monotonic()
            return echo_address(frame) if last[0] - before >= NEEDED_GAP else None
        with line({1: quick, 2: slow}) as running:
            found = self.expect(running, "gap-too-short", 2, "oven")
            self.assertRegex(found["advice"], r"`timing.frame_gap` to \d+ms")

    def test_a_panel_that_was_off_is_silent_and_needs_no_longer_gap(self):
        off = [False]
        with line({1: echo_address, 2: lambda f: None if off[0] else echo_address(f)}) as running:
            running.ask_both(20)
            for _ in range(2):
                off[0] = True
                running.until(lambda found: [one["cause"] for one in found] == ["station-silent"])
                off[0] = False
                running.until(lambda found: not found)
                running.ask_both(20)
            self.assertEqual(running.findings(), [])
            self.assertEqual(set(self.said(running.program)), {("station-silent", "oven")})

    def test_one_panel_with_a_loose_plug_is_no_second_panel(self):
        seen = itertools.count(1)

        def loose(frame):
            return Raw(flipped(reply_of(frame)) if next(seen) % 12 == 0 else reply_of(frame))
        with line({1: echo_address, 2: loose}) as running:
            self.expect(running, "damaged-replies", 2, "oven", drive=lambda: running.ask_both(20))

    def test_a_panel_that_needs_a_longer_timeout(self):
        with line({1: echo_address}) as running:
            def ask():
                running.client.ask(1, read_registers(7))
                request = read_registers(9)
                running.client.ask(2, request)
                running.bus.inject(reply_of(harness.rtu(2, request)))
            found = self.expect(running, "timeout-too-short", 2, "oven", drive=ask)
            self.assertRegex(found["advice"], r"`timing.response_timeout` to \d+ms")

    def test_another_master(self):
        with line({1: echo_address, 2: echo_address}) as running:
            def between():
                running.ask_both()
                request = harness.rtu(5, read_registers(9))
                running.bus.inject(request + reply_of(request))
                running.ask_both()
            self.expect(running, "other-master", drive=between)

    def test_a_panel_whose_crc_comes_the_other_way_round(self):
        def old(frame):
            good = reply_of(frame)
            return Raw(good[:-2] + good[:-3:-1])
        with line({1: echo_address, 2: old}) as running:
            found = self.expect(running, "wrong-crc-order", 2, "oven")
            self.assertIn("Set its `crc_order: high_first`", found["advice"])

    def test_a_panel_that_refuses_with_another_functions_number(self):
        with line({1: echo_address, 2: lambda _: b"\x84\x02"}) as running:
            found = self.expect(running, "wrong-exception", 2, "oven")
            self.assertIn("another function", found["text"])

    def test_a_panel_that_answers_broadcasts(self):
        def broadcasts():
            running.client.ask(0, struct.pack(">BHH", 6, 9, 1))
            running.ask_both()
        with line({0: lambda frame: Raw(harness.rtu(2, frame[1:6])),
                   1: echo_address, 2: echo_address}) as running:
            found = self.expect(running, "answers-broadcasts", 2, "oven", drive=broadcasts)
            self.assertIn("`timing.broadcast_turnaround`", found["advice"])

    def test_an_echo_that_the_configuration_denies(self):
        panels = {1: echo_address, 2: echo_address}
        with line(panels, "off", echo=lambda frame: frame) as running:
            self.expect(running, "echo")

    def test_an_echo_that_the_configuration_invents(self):
        with line({1: echo_address, 2: echo_address}, "on") as running:
            self.expect(running, "echo")


if __name__ == "__main__":
    unittest.main()
