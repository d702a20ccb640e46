"""Simulated panels that misbehave on demand."""
import pathlib
import re
import tempfile
import unittest

import config
import harness

PRESS = "/api/v1/simulator/press"
UW0 = "/api/v1/stations/press/devices/UW0"
PANELS = config.gateway(  # nobody polls: each request is the test's
    config.line(stations=config.PRESS + ", {id: 20, name: oven, profile: panasonic-gt}"),
    http=config.ADMIN)


class Simulator(unittest.TestCase):
    def test_a_panel_dies_and_comes_back(self):
        with harness.configured(PANELS) as program:
            self.assertEqual(program.values(UW0), [10])
            status, body = program.rest("PUT", PRESS, {"dead": True})
            self.assertEqual((status, body["faults"]["dead"]), (200, 1))
            self.assertEqual([program.get(UW0)[0] for _ in range(3)], [504] * 3)
            program.log.wait_for("station offline")
            self.assertEqual(program.values("/api/v1/stations/oven/devices/GDT108?count=1"),
                             program.values("/api/v1/stations/oven/devices/GDT108?count=1"))
            self.assertEqual(program.rest("PUT", PRESS, {})[0], 200)
            program.log.wait_for("station online")
            self.assertEqual(program.values(UW0), [10])

    def test_every_fault_has_its_answer(self):
        with harness.configured(PANELS) as program:
            # A damaged address or function is nobody's reply: silence.
            for fault, expected in (("drop", {504}), ("damage", {502, 504}), ("truncate", {502}),
                                    ("foreign_id", {504})):
                self.assertEqual(program.rest("PUT", PRESS, {fault: 1})[0], 200)
                self.assertIn(program.get(UW0)[0], expected, fault)
                self.assertEqual(program.rest("PUT", PRESS, {})[0], 200)
                self.assertEqual(program.values(UW0), [10], fault)

    def test_the_configuration_can_say_so_too(self):
        text = config.gateway(
            config.line(device="/dev/never-opened", timing="{response_timeout: 60ms}",
                        simulate="{echo: true}", stations="""
      {id: 31, name: press, profile: autonics-gplp-s,
       simulate: {slow: 5ms, late: 0.5, late_by: 10ms}},
      {id: 20, name: oven, profile: panasonic-gt, simulate: {dead: true}}"""),
            modbus=None, http=config.ADMIN)
        with harness.configured(text, "--simulate") as program:
            self.assertEqual(program.values(UW0), [10])
            self.assertEqual(program.get("/api/v1/stations/oven/devices/GDT0")[0], 504)
            self.assertEqual(program.get("/api/v1/lines/floor1")[1]["echo"], "present")
            self.assertEqual(program.get(PRESS)[1]["faults"]["late"], 0.5)

    def test_what_is_no_fault_is_refused(self):
        with harness.configured(PANELS) as program:
            for body in ({"dread": 1}, {"drop": 2}, {"drop": "often"}):
                self.assertEqual(program.rest("PUT", PRESS, body)[0], 400, body)
            self.assertEqual(program.get("/api/v1/simulator/nobody")[0], 404)
            self.assertEqual(program.get(PRESS)[1]["faults"]["drop"], 0)

    def test_simulate_says_where_its_panels_are(self):
        with tempfile.TemporaryDirectory() as folder:
            file, link = (pathlib.Path(folder) / name for name in ("panels.yaml", "floor2"))
            file.write_text(config.gateway(
                config.line(), config.line("floor2", stations="{id: 7, name: oven}"),
                config.line("floor3", stations="{id: 8}")))
            with harness.Program("simulate", "-c", str(file), "--line", f"floor2={link}",
                                 "--line", "floor3=tcp://127.0.0.1:0") as program:
                program.out.wait_for("Ctrl-C")
                lines = program.out.text().splitlines()
                for pattern, line in zip((
                        r"^line floor1: /dev/pts/\d+, 38400 8N1$",
                        r"^  station 31 press, autonics-gplp-s$",
                        rf"^line floor2: {re.escape(str(link))} -> /dev/pts/\d+, 38400 8N1$",
                        r"^  station 7 oven, generic$",
                        r"^line floor3: tcp://127\.0\.0\.1:[1-9]\d*, 38400 8N1$",
                        r"^  station 8 floor3-8, generic$"), lines):
                    self.assertRegex(line, pattern)

    def test_simulate_takes_faults_over_rest(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "panels.yaml"
            file.write_text(config.gateway(config.line()))
            with harness.Program("simulate", "-c", str(file), "--http", "127.0.0.1:0",
                                 "--line", "floor1=tcp://127.0.0.1:0") as panels:
                port = panels.log.wait_for(r"rtu_over_tcp=127\.0\.0\.1:(\d+)").group(1)
                self.assertEqual(panels.get("/api/v1/simulator/floor1:31"), panels.get(PRESS))
                self.assertIn(f":{panels.http_port()}/api/v1/simulator/",
                              panels.out.wait_for("faults: (.*)").group(1))
                self.assertEqual(panels.get("/readyz")[0], 200)
                self.assertEqual(panels.get("/api/v1/lines")[0], 404)
                with harness.configured(config.gateway(config.line(
                        device=f"tcp://127.0.0.1:{port}"))) as gateway:
                    gateway.log.wait_for("line up")
                    self.assertEqual(gateway.values(UW0), [10])
                    self.assertEqual(panels.rest("PUT", PRESS, {"dead": True})[0], 200)
                    self.assertEqual(panels.get(PRESS)[1]["faults"]["dead"], 1)
                    self.assertEqual(gateway.get(UW0)[0], 504)


if __name__ == "__main__":
    unittest.main()
