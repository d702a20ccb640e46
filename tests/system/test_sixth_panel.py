"""A panel that nobody has heard of, added by one YAML file: no line of code knows it."""
import pathlib
import tempfile
import unittest

import config
import harness
from harness import read_registers
from test_points import until

PANEL = """
description: Acme AX-7, a panel of this test
manual: AX-7 communication manual, 3rd edition
stations: {first: 1, last: 99, source: p. 4}
serial: {baud: [9600, 19200], parity: [even], stop_bits: [1], source: p. 5}
functions:
  - {code: 1, source: p. 9}
  - {code: 3, max: 16, source: p. 9}
  - {code: 15, source: p. 10}
  - {code: 16, max: 16, broadcast: true, source: p. 10}
areas:
  - name: V
    description: variables
    notation: {prefix: V, base: 1}
    table: holding-registers
    readable: [0, 499]
    writable: [100, 499]
    source: p. 11
  - name: VB
    description: bits of the variables
    notation: {prefix: VB, bit: hex}
    table: coils
    readable: [0, 7999]
    writable: [1600, 7999]
    view_of: V
    source: p. 12
timing: {frame_gap_characters: 5, source: p. 6}
exceptions:
  - {code: 2, meaning: no such variable}
simulation:
  memory: [{area: V, address: 0, values: [7, 8, 9]}]
  motion: [{area: V, address: 20, kind: ramp, low: 0, high: 1000, period: 10s}]
"""
STATION = """
      {id: 9, name: acme, profile: acme-ax-7, guard: true,
       points: [
         {name: setpoint, at: V101, type: i32, word_order: CDAB, writable: true, every: 20ms},
         {name: alarm, at: VB1003, writable: true, every: 20ms}]}"""


def configuration(folder):
    return config.gateway(config.line("hall", stations=STATION, baud=19200, parity="even"),
                          profiles_dir=folder, http=config.ADMIN)


class SixthPanel(unittest.TestCase):
    def test_a_file_is_all_that_a_new_panel_needs(self):
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "acme-ax-7.yaml").write_text(PANEL)
            with harness.configured(configuration(folder)) as program, program.client() as client:
                self.assertEqual(program.values("/api/v1/stations/acme/devices/V1?count=3"), [7, 8, 9])
                self.assertEqual(client.ask(9, read_registers(0, 3))[2:], b"\0\7\0\x08\0\x09")
                point = "/api/v1/stations/acme/points/"
                self.assertEqual(program.rest("PUT", point + "setpoint", {"value": -100000})[0], 200)
                until(lambda: program.get(point + "setpoint")[1]["value"] == -100000)
                self.assertEqual(program.rest("PUT", point + "alarm", {"value": True})[0], 200)
                until(lambda: program.get(point + "alarm")[1]["value"] is True)
                # VB1003 is bit 3 of the word with offset 100: V101, the low word of the setpoint.
                low = (-100000 & 0xFFFF) | 8
                self.assertEqual(program.values("/api/v1/stations/acme/devices/V101"), [low])
                self.assertEqual(client.ask(9, read_registers(0, 17)), b"\x83\x03")  # its own limit
                self.assertEqual(client.ask(9, read_registers(500)), b"\x83\x02")
                status, body = program.get("/api/v1/stations/acme/devices/V501")
                self.assertEqual(status, 422)
                self.assertIn("V1 to V500", body["detail"])

    def test_a_fault_in_it_is_told_with_its_place(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "acme-ax-7.yaml"
            file.write_text(PANEL.replace("writable: [100, 499]", "writable: [100, 500]"))
            whole = pathlib.Path(folder) / "config.yml"
            whole.write_text(configuration(folder))
            ended = harness.run("check", "-c", str(whole))
            self.assertEqual(ended.returncode, 78)
            self.assertRegex(ended.stderr, r"acme-ax-7\.yaml:17:\d+: writable must lie inside readable")


if __name__ == "__main__":
    unittest.main()
