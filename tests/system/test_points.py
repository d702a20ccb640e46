"""Points, polls, the memory of max_age, guards and relays, on the real program."""
import contextlib
import csv
import io
import pathlib
import re
import struct
import tempfile
import threading
import unittest
import urllib.request

import config
import harness
from harness import read_registers
from rtu_bus import RtuBus, echo_address

PRESS_LINE = config.line(
    timing="{response_timeout: 100ms}", offline="{probe_min: 100ms, probe_max: 200ms}", stations="""
      {id: 31, name: press, profile: autonics-gplp-s, guard: true, max_age: 10s,
       points: [
         {name: level, at: UW100, type: i16, scale: 0.1, unit: celsius, writable: true, max: 400,
          every: 20ms},
         {name: total, at: UW102, type: u32, word_order: CDAB, writable: true, every: 20ms},
         {name: running, at: UB1632, writable: true, every: 20ms},
         {name: mode, at: UW105, labels: {0: stopped, 1: running}, writable: true, every: 20ms}],
       poll: [{read: UW0, count: 5, every: 20ms}]}""")
PRESS = config.gateway(PRESS_LINE, http=config.ADMIN)
POINT = "/api/v1/stations/press/points/"


def until(what, patience=harness.PATIENCE):
    """Asks again and again until it is true; each time costs a request to the program."""
    done = threading.Event()
    timer = threading.Timer(patience, done.set)
    timer.start()
    try:
        while not done.is_set():
            result = what()
            if result:
                return result
    finally:
        timer.cancel()
    raise AssertionError(f"never true: {what}")


def quality(program, point):
    return program.get(POINT + point)[1]["quality"]


class Points(unittest.TestCase):
    def test_points_are_polled_written_and_shown(self):
        with harness.configured(PRESS) as program:
            until(lambda: quality(program, "total") == "good")
            self.assertEqual(program.rest("PUT", POINT + "level", {"value": 21.5}),
                             (200, {"transmitted": True, "confirmed": True, "value": 21.5}))
            level = until(lambda: (lambda p: p if p["value"] == 21.5 else None)(
                program.get(POINT + "level")[1]))
            self.assertEqual((level["unit"], level["quality"], level["at"]),
                             ("celsius", "good", "UW100"))
            self.assertEqual(program.values("/api/v1/stations/press/devices/UW100"), [215])
            self.assertEqual(program.rest("PUT", POINT + "total", {"value": 0x01020304})[0], 200)
            self.assertEqual(program.rest("PUT", POINT + "running", {"value": True})[0], 200)
            self.assertEqual(program.rest("PUT", POINT + "mode", {"value": "running"})[0], 200)
            until(lambda: program.get(POINT + "mode")[1].get("label") == "running")
            until(lambda: program.get(POINT + "total")[1]["value"] == 0x01020304)
            until(lambda: program.get(POINT + "running")[1]["value"] is True)
            # The same words, read as they lie: UW102 holds the low one.
            self.assertEqual(program.values("/api/v1/stations/press/devices/UW102?count=2"),
                             [0x0304, 0x0102])
            metric = (r'panelgate_point_value\{line="floor1",station="press",'
                      r'point="level",unit="celsius"\} 21\.5')
            until(lambda: re.search(metric, program.get("/metrics")[1]))  # a poll's, of its own time
            self.assertIn('panelgate_point_age_seconds{', program.get("/metrics")[1])

    def test_what_cannot_be_written_says_why(self):
        with harness.configured(PRESS) as program:
            for point, value, status, text in (
                    ("level", 400.5, 422, "level must be at most 400"),
                    ("total", -1, 422, "total must be from 0 to 4294967295"),
                    ("total", 1.5, 422, "total cannot be exactly 1.5"),
                    ("level", 21.55, 422, "the nearest that it can be are 21.5 and 21.6"),
                    ("mode", "walking", 422, "mode has no label 'walking'"),
                    ("level", None, 400, "value must be"), ("pressure", 1, 404, "no point")):
                got, body = program.rest("PUT", POINT + point, {"value": value})
                self.assertEqual(got, status, body)
                self.assertIn(text, body["detail"])
            self.assertEqual(program.rest("PUT", POINT + "level?round=true", {"value": 21.56}),
                             (200, {"transmitted": True, "confirmed": True, "value": 21.6}))

    def test_P10_a_dead_panel_is_stale_then_absent_and_its_age_grows(self):
        with harness.configured(PRESS) as program:
            until(lambda: quality(program, "level") == "good")
            program.rest("PUT", "/api/v1/simulator/press", {"dead": True})
            until(lambda: quality(program, "level") == "stale")
            first = program.get(POINT + "level")[1]["age_ms"]
            until(lambda: "panelgate_point_value{" not in program.get("/metrics")[1])
            until(lambda: program.get(POINT + "level")[1]["age_ms"] > first)
            program.rest("PUT", "/api/v1/simulator/press", {})
            until(lambda: quality(program, "level") == "good")

    def test_P6_polled_values_answer_clients_for_max_age(self):
        with harness.configured(PRESS) as program, program.client() as client:
            def poll():
                return program.get("/api/v1/stations/press")[1]["polls"][0]
            until(lambda: poll()["quality"] == "good")
            self.assertEqual((poll()["read"], poll()["every_ms"]), ("UW0", 20))
            self.assertEqual(client.ask(31, read_registers(0, 5))[:4], b"\x03\x0a\x00\x0a")
            self.assertRegex(program.get("/metrics")[1], r'outcome="cached"\} [1-9]')
            body = program.get("/api/v1/stations/press/devices/UW0?count=5")[1]
            self.assertEqual((body["source"], body["values"]), ("cache", [10, 20, 30, 40, 50]))

    def test_a_guarded_station_is_not_asked_what_its_profile_rules_out(self):
        with harness.configured(PRESS) as program, program.client() as client:
            self.assertEqual(client.ask(31, b"\x17\0\0\0\1\0\0\0\1\2\0\0"), b"\x97\x01")
            self.assertEqual(client.ask(31, read_registers(0xFFF0)), b"\x83\x02")
            self.assertEqual(client.ask(31, struct.pack(">BHHBH", 16, 0, 1, 2, 1)), b"\x90\x02")
            sent = [frame[:6] for way, frame in program.trace("floor1", 500) if way == "sent"]
            self.assertNotIn(bytes([31]) + read_registers(0xFFF0), sent)
            self.assertEqual(client.ask(31, struct.pack(">BHH", 6, 0, 1)), b"\x86\x01")

    def test_one_block_in_every_type_and_order(self):
        with harness.configured(PRESS) as program:
            program.rest("PUT", POINT + "total", {"value": 0x01020304})
            status, body = program.get(
                "/api/v1/stations/press/holding-registers/102/interpretations?count=2")
            self.assertEqual(status, 200, body)
            shown = {(i["type"], i["word_order"]): i["values"] for i in body["interpretations"]}
            self.assertEqual(shown["u32", "CDAB"], [str(0x01020304)])
            self.assertEqual(shown["u32", "ABCD"], [str(0x03040102)])


# Asked for once a minute: what happens meanwhile, the points must learn from the writes.
SELDOM = config.gateway(config.line(stations="""
      {id: 31, name: press, profile: autonics-gplp-s, points: [
         {name: level, at: UW100, writable: true, every: 1min},
         {name: other, at: UW300, every: 1min},
         {name: running, at: UB1632, every: 1min}]}"""), http=config.ADMIN)


class Table(unittest.TestCase):
    POINTS = """
         {name: level, at: UW100, type: i16, scale: 0.1, offset: -3, unit: celsius, writable: true, min: -1.5, max: 400,
          no_value: [-32768, 7], report: {deadband: 0.5, at_most: 1s, at_least: 1min}, overview: true},
         {name: total, at: UW102, type: u32, word_order: CDAB, every: 250ms},
         {name: recipe, at: UW110, type: string, length: 5},
         {name: running, at: UB1632, writable: true}, {name: door, at: UW131, bit: 3},
         {name: mode, at: UW105, labels: {0: "stopped", 1: "it's, \\"on\\""}, writable: true}"""

    def table_of(self, text):
        with harness.configured(text) as program:
            asked = urllib.request.Request(f"http://127.0.0.1:{program.http_port()}/api/v1/points",
                                           headers={"Accept": "text/csv"})
            with urllib.request.urlopen(asked, timeout=harness.PATIENCE) as answer:
                return answer.read().decode()

    def test_points_out_as_csv_and_in_again_are_equal(self):
        station = "{{id: 31, name: press, profile: autonics-gplp-s, {}}}"
        told = self.table_of(config.gateway(config.line(stations=station.format(f"points: [{self.POINTS}]"))))
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "press.csv"
            file.write_text(told, newline="")
            again = self.table_of(config.gateway(config.line(stations=station.format(f"points_file: {file}"))))

        def keys(text):
            rows = list(csv.DictReader(io.StringIO(text)))
            return [{name: cell for name, cell in row.items() if name not in ("value", "label", "quality", "age_ms")}
                    for row in rows]
        self.assertEqual(len(keys(told)), 6)
        self.assertEqual(keys(told), keys(again))


class Written(unittest.TestCase):
    def follows(self, program, write, value):
        """From the answer to the write on, the point never shows another value as good; and it
        shows the new one long before its own turn."""
        def shown():
            point = program.get(POINT + "level")[1]
            metric = re.search(r'panelgate_point_value\{[^}]*point="level"[^}]*\} (\S+)',
                               program.get("/metrics")[1])
            if metric:
                self.assertEqual(float(metric[1]), value)
            if point["quality"] == "good":
                self.assertEqual(point["value"], value)
            return point["quality"] == "good"
        write()
        until(shown)

    def test_P10_a_point_follows_whoever_writes_it(self):
        with harness.configured(SELDOM) as program, program.client() as client:
            until(lambda: all(quality(program, name) == "good"
                              for name in ("level", "other", "running")))
            self.follows(program, lambda: self.assertEqual(
                program.rest("PUT", POINT + "level", {"value": 222})[0], 200), 222)
            self.follows(program, lambda: self.assertEqual(
                client.ask(31, struct.pack(">BHHBH", 16, 100, 1, 2, 333))[0], 16), 333)
            self.follows(program, lambda: self.assertEqual(
                client.ask(0, struct.pack(">BHHBH", 16, 100, 1, 2, 444))[0], 16), 444)
            self.follows(program, lambda: self.assertEqual(
                program.rest("PUT", "/api/v1/stations/press/devices/UW99",
                             {"values": [1, 555]})[0], 200), 555)
            program.rest("PUT", POINT + "level", {"value": 0})
            until(lambda: quality(program, "level") == "good")
            # The panel shows one memory as words and as bits: UB1000 is bit 0 of UW100.
            self.follows(program, lambda: self.assertEqual(
                program.rest("PUT", "/api/v1/stations/press/devices/UB1000",
                             {"values": [1]})[0], 200), 1)

    def test_P6_a_get_behind_a_write_gives_what_the_panel_has(self):
        with harness.configured(SELDOM) as program:
            until(lambda: quality(program, "level") == "good")
            for value in range(1, 21):  # more than the polls read again at once
                self.assertEqual(program.rest("PUT", POINT + "level", {"value": value})[0], 200)
                level = program.get(POINT + "level")[1]
                self.assertEqual((level["value"], level["quality"]), (value, "good"))


class Forgetful:
    """A panel with a few registers that may be silent for a while and then has forgotten them."""

    def __init__(self):
        self.silences = 0

    def __call__(self, frame):
        if self.silences > 0:
            self.silences -= 1
            return None
        return echo_address(frame)


RELAY = "{from: press/UW100, count: 8, to: oven/GDT200, every: 20ms, on_change: true}"


class Relay(unittest.TestCase):
    def test_a_relay_over_two_lines_with_one_unplugged_meanwhile(self):
        with tempfile.TemporaryDirectory() as folder:
            link = pathlib.Path(folder) / "tty"
            oven_line = config.line("floor2", link, "{id: 20, name: oven, profile: panasonic-gt}",
                                    timing="{response_timeout: 100ms}")
            text = config.gateway(PRESS_LINE, oven_line, relays=f"[{RELAY}]", http=config.ADMIN)
            with contextlib.ExitStack() as stack:
                oven = RtuBus(link, {20: echo_address})
                program = stack.enter_context(harness.configured(text))
                client = stack.enter_context(program.client())
                with oven:
                    self.assertEqual(program.rest("PUT", POINT + "level", {"value": 30})[0], 200)
                    until(lambda: any(struct.pack(">HH", 300, 0) in f.bytes
                                      for f in oven.frames(20)))
                    writes = [f.bytes for f in oven.frames(20) if f.bytes[1] == 16]
                    self.assertEqual(writes[-1][2:6], struct.pack(">HH", 200, 8))
                    self.assertEqual(len(writes), len(set(writes)), "on change only")
                # Unplugged: the relay says so, the press is as before.
                relay = until(lambda: (lambda r: r if r["state"].startswith("target failing") else
                                       None)(program.get("/api/v1/relays")[1]["relays"][0]))
                self.assertEqual(relay["name"], "press/UW100 to oven/GDT200")
                self.assertEqual(client.ask(31, read_registers(0))[0], 3)
                until(lambda: quality(program, "level") == "good")
                self.assertRegex(program.get("/metrics")[1], r"panelgate_relay_up\{relay=.*\} 0")
                program.log.wait_for("relay.*state=\"?target failing")
                # Back again: what is there now is written, though nothing has changed.
                with RtuBus(link, {20: echo_address}) as again:
                    again.wait_for(1, 20)
                    until(lambda: program.get("/api/v1/relays")[1]["relays"][0]["state"] == "ok")
                    self.assertIsNotNone(re.search(r"panelgate_relay_up\{relay=.*\} 1",
                                                   program.get("/metrics")[1]))


    def test_a_target_that_was_silent_is_written_again_though_nothing_has_changed(self):
        with tempfile.TemporaryDirectory() as folder:
            link = pathlib.Path(folder) / "tty"
            oven_line = config.line(
                "floor2", link, """{id: 20, name: oven, profile: panasonic-gt,
                                    poll: [{read: GDT300, every: 20ms}]}""",
                timing="{response_timeout: 100ms}")
            text = config.gateway(PRESS_LINE, oven_line, relays=f"[{RELAY}]", http=config.ADMIN)
            panel = Forgetful()
            with RtuBus(link, {20: panel}) as oven, harness.configured(text):
                def writes():
                    return [f for f in oven.frames(20) if f.bytes[1] == 16]
                until(lambda: len(writes()) == 1)
                panel.silences = 2  # a poll and its retry: it may have been switched off and on
                until(lambda: panel.silences == 0)
                until(lambda: len(writes()) == 2)
                self.assertEqual(writes()[0].bytes, writes()[1].bytes)

    def test_what_anybody_else_writes_to_the_target_is_written_over_at_once(self):
        stations = """{id: 31, name: press, profile: autonics-gplp-s},
                      {id: 20, name: oven, profile: panasonic-gt}"""
        seldom = RELAY.replace("20ms", "10s")
        text = config.gateway(config.line(stations=stations), relays=f"[{seldom}]",
                              http=config.ADMIN)
        with harness.configured(text) as program, program.client() as client:
            def relay():
                return program.get("/api/v1/relays")[1]["relays"][0]
            until(lambda: relay()["writes"] == 1)
            target = "/api/v1/stations/oven/devices/GDT200"
            wanted = program.values(target)
            for n, write in enumerate((
                    lambda: program.rest("PUT", target, {"values": [wanted[0] + 1]})[0],
                    lambda: client.ask(20, harness.write_register(207, 4711))[0],
                    lambda: client.ask(0, harness.write_register(200, 4712))[0])):
                self.assertIn(write(), (200, 6))
                until(lambda: relay()["repairs"] == n + 1)
                self.assertEqual(program.values(target), wanted)
            self.assertLess(relay()["reads"], 10, "its own turns are ten seconds apart")
            self.assertRegex(program.get("/metrics")[1], r"relay_repairs_total\{relay=.*\} 3")


if __name__ == "__main__":
    unittest.main()
