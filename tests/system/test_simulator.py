"""Simulated panels that misbehave on demand."""
import unittest

import config
import harness

PRESS = "/api/v1/simulator/press"
UW0 = "/api/v1/stations/press/devices/UW0"


class Simulator(unittest.TestCase):
    def test_a_panel_dies_and_comes_back(self):
        with harness.demo() as program:
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
        with harness.demo() as program:
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
            modbus=None, http=config.OPERATOR)
        with harness.configured(text, "--simulate") as program:
            self.assertEqual(program.values(UW0), [10])
            self.assertEqual(program.get("/api/v1/stations/oven/devices/GDT0")[0], 504)
            self.assertEqual(program.get("/api/v1/lines/floor1")[1]["echo"], "present")
            self.assertEqual(program.get(PRESS)[1]["faults"]["late"], 0.5)

    def test_what_is_no_fault_is_refused(self):
        with harness.demo() as program:
            for body in ({"dread": 1}, {"drop": 2}, {"drop": "often"}):
                self.assertEqual(program.rest("PUT", PRESS, body)[0], 400, body)
            self.assertEqual(program.get("/api/v1/simulator/nobody")[0], 404)
            self.assertEqual(program.get(PRESS)[1]["faults"]["drop"], 0)


if __name__ == "__main__":
    unittest.main()
