"""The plan of `check`: its shape, its verdicts, and whether lines are as busy as it says."""
import json
import pathlib
import re
import tempfile
import time
import unittest

import config
import harness
from harness import SANITIZED, run

BAD_CONFIG = 78
TURN = 0.4  # seconds: all intervals below divide it, so each window of some turns has the same reads


def press(name, number, every):
    return (f"{{id: {number}, name: {name}, profile: generic, "
            f"poll: [{{read: 400001, count: 32, every: {every}}}]}}")


class Check(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.file = pathlib.Path(folder.name) / "gateway.yaml"

    def check(self, text, *more, code=0):
        self.file.write_text(text)
        ended = run("check", "-c", str(self.file), *more)
        self.assertEqual(ended.returncode, code, ended.stdout + ended.stderr)
        return ended

    def plan(self, text, *more, code=0):
        return json.loads(self.check(text, "--format", "json", *more, code=code).stdout)

    def test_a_line_has_its_polls_its_relays_and_what_is_left(self):
        text = config.gateway(
            config.line(stations=press("press", 31, "1s") + ", {id: 5, name: mixer, profile: "
                        "generic, points: [{name: level, at: 400101, every: 5s}]}"),
            relays="[{from: press/400101, to: mixer/400201, every: 2s, on_change: true}]")
        [line] = self.plan(text)["lines"]
        # 8 and 69 characters of 10 bits at 38400, two gaps of 1.75 ms, 1 ms to think
        wire = 1000 * (77 * 10 / 38400 + 2 * 0.00175 + 0.001)
        first, second = line["polls"]
        self.assertEqual([first[key] for key in ("station", "read", "count", "every_ms")],
                         ["press", "400001", 32, 1000])
        self.assertAlmostEqual(first["wire_ms"], wire, 2)
        self.assertAlmostEqual(first["load_percent"], wire / 10, 2)
        self.assertEqual([second["station"], second["read"], second["every_ms"]],
                         ["mixer", "400101", 5000])
        self.assertEqual([(r["station"], r["request"], r["every_ms"]) for r in line["relays"]],
                         [("press", "read", 2000), ("mixer", "write", 60000)])
        parts = line["polls"] + line["relays"]
        self.assertAlmostEqual(line["load_percent"], sum(p["load_percent"] for p in parts), 2)
        self.assertGreater(line["most_percent"], line["load_percent"])
        self.assertEqual((line["verdict"], line["advice"]), ("fine", []))
        self.assertEqual(line["one_dead"]["station"], "mixer")
        # a little more than in proportion: the refresh stays
        times = line["highest_rate"]["times_as_often"]
        polled = line["load_percent"] - parts[-1]["load_percent"]
        self.assertAlmostEqual(times, (80 - parts[-1]["load_percent"]) / polled, 1)
        self.assertEqual(line["highest_rate"]["limited_by"], "load_percent")
        self.assertAlmostEqual(line["headroom"]["load_percent"], 100 - line["load_percent"], 2)

    def test_the_text_says_the_same(self):
        told = self.check(config.gateway(config.line(stations=press("press", 31, "1s"))))
        for shown in ("plan of line floor1, 38400 8N1: 2.5 % of its time",
                      "  asks press 400001, count 32, every 1s: 24.6ms, 2.5 %",
                      "  with press dead: 5 % at most; a station that falls silent holds the "
                      "others up for 503.8ms, once",
                      "  left for clients: 97.5 %, 74.5 reads of 10 registers a second",
                      "  highest rate: all of this 32.6 times as often, up to 80 %; once through "
                      "takes 24.6ms"):
            self.assertIn(shown, told.stdout)
        self.assertNotIn("planned", told.stderr)

    def test_a_busy_line_is_a_warning_with_advice(self):
        text = config.gateway(config.line(baud=9600, stations=press("press", 31, "105ms")))
        told = self.check(text)
        self.assertRegex(told.stderr, r"warning: line floor1 is planned to be busy for 8\d\.?\d? % "
                         r"of its time at 9600 8N1: .*serial: \{baud: 19200\}.* brings 4\d")
        plan = self.plan(text)
        self.assertTrue(plan["valid"])
        self.assertEqual(len([w for w in plan["warnings"] if "planned to be busy" in w]), 1)
        self.assertEqual(plan["lines"][0]["verdict"], "high")
        for advice in plan["lines"][0]["advice"]:
            self.assertLess(advice["load_percent"], plan["lines"][0]["load_percent"])

    def test_advice_that_is_followed_brings_what_it_says(self):
        def text(baud=9600):
            return config.gateway(config.line(baud=baud, stations=press("press", 31, "60ms")))
        [told] = self.plan(text(), code=BAD_CONFIG)["lines"][0]["advice"]
        self.assertIn("baud: 19200", told["what"])
        [line] = self.plan(text(baud=19200))["lines"]
        self.assertEqual(line["verdict"], "fine")
        self.assertAlmostEqual(line["load_percent"], told["load_percent"], 2)

    def test_what_is_too_much_while_values_change_is_told_in_that_figure(self):
        def text(baud):
            return config.gateway(
                config.line("a", stations="{id: 1, name: x}"),
                config.line("b", baud=baud, stations="{id: 2, name: y}"),
                relays="[{from: x/400001, count: 100, to: y/400001, every: 1s, on_change: true}]")
        told = self.check(text(1200)).stderr
        self.assertRegex(told, r"warning: line b is planned to be busy for 186.* while values "
                               r"change.*baud: 2400.* brings 9[34][\d.]* % while values change")
        line = self.plan(text(1200))["lines"][1]
        self.assertLess(line["highest_rate"]["times_as_often"], 1)
        self.assertEqual(line["highest_rate"]["limited_by"], "most_percent")
        followed = self.plan(text(2400))["lines"][1]
        self.assertEqual(followed["verdict"], "fine")
        [promised] = [one for one in line["advice"] if "baud: 2400" in one["what"]]
        self.assertAlmostEqual(followed["most_percent"], promised["most_percent"], 2)
        self.assertAlmostEqual(followed["load_percent"], promised["load_percent"], 2)

    def test_polls_that_cannot_do_are_warnings(self):
        slow = "{id: 1, name: x, timing: {think_time: 3s}, poll: [{read: 400001, every: 60s}]}"
        long = ("{id: 1, name: x, poll: [{read: 400001, count: 100, every: 60s}, "
                "{read: 400201, count: 50, every: 60s}]}")
        for text, wanted in ((config.line(stations=slow), "would time out"),
                             (config.line(baud=1200, stations=long), "queue: {deadline: 3s}")):
            plan = self.plan(config.gateway(text))
            self.assertTrue(plan["valid"])
            [said] = [w for w in plan["warnings"] if w.startswith("line ") and wanted in w]
            self.assertIn(f"warning: {said}", self.check(config.gateway(text)).stderr)
        with harness.configured(config.gateway(config.line(stations=slow))) as program:
            program.log.wait_for(r" warn .*planned requests.*would time out")

    def test_more_than_there_is_is_an_error_unless_it_is_wanted(self):
        text = config.gateway(config.line(baud=9600, stations=press("press", 31, "50ms")))
        told = self.check(text, code=BAD_CONFIG)
        self.assertIn(f"{self.file}:2:11: line floor1 is planned to be busy for ", told.stderr)
        self.assertIn("--allow-overload", told.stderr)
        self.assertIn("plan of line floor1", told.stdout)
        plan = self.plan(text, code=BAD_CONFIG)
        self.assertFalse(plan["valid"])
        [error] = plan["errors"]
        self.assertIn("line floor1", error["message"])
        self.assertEqual((error["file"], error["line"], error["column"]), (str(self.file), 2, 11))
        self.assertIn("warning: line floor1", self.check(text, "--allow-overload").stderr)
        self.assertEqual(self.plan(text, "--allow-overload")["errors"], [])

    def test_run_starts_all_the_same_and_warns(self):
        text = config.gateway(config.line(baud=9600, stations=press("press", 31, "50ms")))
        with harness.configured(text) as program:
            program.log.wait_for(r" warn .*planned load.*line floor1 is planned to be busy for 1\d\d")


@unittest.skipIf(SANITIZED, "a sanitizer takes the time that is measured here")
class Measured(unittest.TestCase):
    """Planned against bus_busy_seconds_total, on simulated panels that answer at their line's pace
    and think for as long as the plan assumes."""

    TEXT = config.gateway(
        *(config.line(f"at{baud}", baud=baud,
                      stations=press(f"a{baud}", 1, "200ms") + ", " +
                      f"{{id: 2, name: b{baud}, profile: generic, points: ["
                      f"{{name: p, at: 400101, every: 400ms}}, {{name: q, at: '000181', every: 400ms}}]}}")
          for baud in (9600, 38400)),
        modbus=None,
        relays="[" + ", ".join(f"{{from: a{baud}/400051, count: 4, to: b{baud}/400201, every: 400ms}}"
                               for baud in (9600, 38400)) + "]")

    def busy(self, program):
        """(when, {line: busy seconds})"""
        text = program.get("/metrics")[1]
        found = re.findall(r'(?m)^panelgate_bus_busy_seconds_total\{line="(\w+)"\} (\S+)$', text)
        return time.monotonic(), {line: float(seconds) for line, seconds in found}

    def test_lines_are_as_busy_as_planned(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "plan.yaml"
            file.write_text(self.TEXT)
            plan = json.loads(run("check", "-c", str(file), "--format", "json").stdout)
        planned = {line["name"]: line["load_percent"] for line in plan["lines"]}
        with harness.configured(self.TEXT) as program:
            time.sleep(5 * TURN)  # not what is waited for, but what is not measured: the start
            began, before = self.busy(program)
            time.sleep(30 * TURN)  # … and what is
            ended, after = self.busy(program)
        self.assertGreater(planned["at9600"], 60)
        for line, load in planned.items():
            measured = 100 * (after[line] - before[line]) / (ended - began)
            print(f"{line}: planned {load:.2f} %, measured {measured:.2f} %, "
                  f"ratio {measured / load:.4f}")
            self.assertLess(abs(measured / load - 1), 0.03, (line, load, measured))


if __name__ == "__main__":
    unittest.main()
