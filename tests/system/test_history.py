"""The last hour of points and lines, in memory."""
import csv
import datetime
import io
import json
import subprocess
import unittest

import config
import harness
from test_points import until

LINE = config.line(timing="{response_timeout: 60ms}", retries=0, stations="""
      {id: 31, name: press, profile: autonics-gplp-s, points: [
        {name: level, at: UW100, type: i16, scale: 0.1, unit: celsius, writable: true, every: 200ms},
        {name: running, at: UB1632, writable: true, every: 200ms},
        {name: title, at: UW200, type: string, length: 4}]}""")
GATEWAY = config.gateway(LINE, config.line("floor3", device="/dev/null", stations="{id: 8, name: scale}"),
                         http=config.ADMIN, modbus=None)
POINT = "/api/v1/stations/press/points/"


def instant(text):
    return datetime.datetime.fromisoformat(text.replace("Z", "+00:00"))


class History(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.program = cls.enterClassContext(harness.configured(GATEWAY))

    def samples(self, name):
        return self.program.get(POINT + name + "/history")[1]["samples"]

    def write(self, name, value):
        self.assertEqual(self.program.rest("PUT", POINT + name, {"value": value})[0], 200)

    def test_a_point_has_what_it_was_at_the_time_it_was_read(self):
        before = datetime.datetime.now(datetime.timezone.utc) - datetime.timedelta(seconds=1)
        for value in (17.5, 0, -3.2):
            self.write("level", value)
            until(lambda: [s["value"] for s in self.samples("level")][-1:] == [value])
        status, told = self.program.get(POINT + "level/history")
        self.assertEqual((status, told["unit"], told["every_ms"]), (200, "celsius", 1000))
        times = [instant(sample["time"]) for sample in told["samples"]]
        self.assertEqual(times, sorted(set(times)))
        after = datetime.datetime.now(datetime.timezone.utc)
        self.assertTrue(before <= times[-1] <= after, (before, times[-1], after))
        self.write("running", True)
        until(lambda: self.samples("running")[-1]["value"] is True)
        self.assertEqual(self.program.get(POINT + "title/history")[0], 404)

    def test_P10_a_dead_panel_leaves_a_gap_and_no_zero(self):
        self.write("level", 21.5)
        until(lambda: [s["value"] for s in self.samples("level")][-1:] == [21.5])
        self.program.rest("PUT", "/api/v1/simulator/press", {"dead": True})
        try:
            until(lambda: self.samples("level")[-1]["value"] is None)
        finally:
            self.program.rest("PUT", "/api/v1/simulator/press", {})
        until(lambda: self.samples("level")[-1]["value"] == 21.5)
        values = [sample["value"] for sample in self.samples("level")]
        self.assertEqual(values[values.index(21.5):].count(0), 0)

    def test_a_line_has_its_load_requests_and_latency(self):
        path = "/api/v1/lines/floor1/history"
        until(lambda: any(s["requests"] and s["wire_ms"] for s in self.program.get(path)[1]["samples"]))
        sample = next(s for s in self.program.get(path)[1]["samples"] if s["wire_ms"])
        self.assertTrue(0 < sample["load_percent"] <= 100, sample)
        self.assertGreater(sample["latency_ms"], 0)
        self.assertGreaterEqual(sample["requests"], sample["errors"])

    def test_P10_a_line_that_is_down_has_no_load(self):
        path = "/api/v1/lines/floor3/history"
        until(lambda: self.program.get(path)[1]["samples"])
        self.assertEqual({s["load_percent"] for s in self.program.get(path)[1]["samples"]}, {None})

    def test_a_table_for_spreadsheets_by_curl(self):
        self.write("level", 12.5)
        until(lambda: [s["value"] for s in self.samples("level")][-1:] == [12.5])
        done = subprocess.run(["curl", "-s", "-H", "Accept: text/csv",
                               self.program.url(POINT + "level/history")],
                              capture_output=True, text=True, timeout=harness.PATIENCE, check=True)
        rows = list(csv.DictReader(io.StringIO(done.stdout)))
        self.assertEqual(set(rows[0]), {"time", "value"})
        self.assertIn("12.5", [row["value"] for row in rows])

    def test_it_stays_small_for_many_points(self):
        many = config.wide(2, 10, 100, every="60s")
        with harness.configured(many) as program:
            told = program.get("/api/v1/stations/s1-1/points/p0/history")[1]
            self.assertEqual(told["every_ms"], 5000)  # 2000 points in 16 MiB
            self.assertLess(len(json.dumps(told)), 1000)


if __name__ == "__main__":
    unittest.main()
