"""Clients that only know 05 and 06 write to panels that only know 15 and 16, on the real program:
pymodbus, mbpoll and REST get their own function back, and the panel never sees it."""
import struct
import subprocess
import unittest

from pymodbus.client import ModbusTcpClient

import config
import harness

# Unit, a coil and a register that may be written, and what goes out for 05 and 06.
PANELS = {
    "press": (31, 1600, 100, 15, 16),
    "mixer": (5, None, 100, None, 16),
    "io": (17, 3, 20, 5, 6),
    "oven": (20, 275, 510, 5, 6),
    "filler": (1, 20, 100, 15, 6),
}
STATIONS = """
      {id: 31, name: press, profile: autonics-gplp-s}, {id: 5, name: mixer, profile: autonics-gp-2005},
      {id: 17, name: io, profile: autonics-arm}, {id: 20, name: oven, profile: panasonic-gt},
      {id: 1, name: filler, profile: omron-cp2e}"""
REFUSED_BY_MANUAL = struct.pack(">BHH", 4, 0, 5)


def sent(program, unit):
    """The functions on the wire to this unit so far."""
    return [frame[1] for way, frame in program.trace("floor1", 500)
            if way == "sent" and frame[0] == unit]


class Translation(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.program = cls.enterClassContext(harness.configured(
            config.gateway(config.line(stations=STATIONS), http=config.ADMIN)))
        cls.client = ModbusTcpClient("127.0.0.1", cls.program.modbus_port())
        cls.client.connect()
        cls.addClassCleanup(cls.client.close)

    def test_pymodbus_writes_one_register_to_each_panel(self):
        for name, (unit, _, word, _, by) in PANELS.items():
            with self.subTest(name):
                before = len(sent(self.program, unit))
                self.assertFalse(self.client.write_register(word, 0x1234, slave=unit).isError())
                self.assertEqual(sent(self.program, unit)[before:], [by])
                self.assertEqual(
                    self.client.read_holding_registers(word, 1, slave=unit).registers, [0x1234])

    def test_pymodbus_writes_one_coil_to_each_panel_that_has_coils(self):
        for name, (unit, coil, _, by, _) in PANELS.items():
            if coil is None:
                continue
            for value in (True, False):
                with self.subTest(name, value=value):
                    before = len(sent(self.program, unit))
                    self.assertFalse(self.client.write_coil(coil, value, slave=unit).isError())
                    self.assertEqual(sent(self.program, unit)[before:], [by])
                    self.assertEqual(self.client.read_coils(coil, 1, slave=unit).bits[0], value)

    def test_mbpoll_sets_a_coil_and_a_register(self):
        mbpoll = ["mbpoll", "-m", "tcp", "-p", str(self.program.modbus_port()), "-1", "-0", "-a",
                  "31"]
        for table, address, value in ((0, 1700, 1), (4, 101, 77)):
            run = subprocess.run([*mbpoll, "-t", str(table), "-r", str(address), "127.0.0.1",
                                  str(value)], capture_output=True, text=True, timeout=30)
            self.assertEqual(run.returncode, 0, run.stdout + run.stderr)
        self.assertTrue(self.client.read_coils(1700, 1, slave=31).bits[0])
        self.assertEqual(self.client.read_holding_registers(101, 1, slave=31).registers, [77])

    def test_a_client_gets_its_own_function_back_with_an_exception_too(self):
        with self.program.client() as client:
            written = struct.pack(">BHH", 6, 100, 7)
            self.assertEqual(client.ask(31, written), written)
            self.assertEqual(client.ask(31, struct.pack(">BHH", 6, 0, 7)), b"\x86\x03")
            self.assertEqual(client.ask(31, struct.pack(">BHH", 5, 0, 0xFF00)), b"\x85\x03")
            self.assertEqual(client.ask(31, struct.pack(">BHH", 5, 1600, 0x1234)), b"\x85\x01",
                             "no coil's value: it goes as it came")
            self.assertEqual(client.ask(5, struct.pack(">BHH", 5, 1600, 0xFF00)), b"\x85\x01",
                             "this panel has no function for coils at all")

    def test_raw_goes_the_same_way(self):
        status, body = self.program.rest("POST", "/api/v1/lines/floor1/raw",
                                         {"station": 31, "pdu": "060066002A"})
        self.assertEqual((status, body["pdu"]), (200, "060066002A"))
        self.assertEqual(self.client.read_holding_registers(102, 1, slave=31).registers, [42])

    def test_the_manuals_refusal_of_function_04_is_not_translated(self):
        with self.program.client() as client:
            self.assertEqual(client.ask(31, REFUSED_BY_MANUAL), b"\x84\x01")
            self.assertEqual(client.ask(5, REFUSED_BY_MANUAL), b"\x84\x01")

    def test_a_broadcast_goes_out_as_it_came(self):
        with self.program.client() as client:
            written = struct.pack(">BHH", 6, 103, 9)
            self.assertEqual(client.ask(0, written), written)
            self.assertEqual(sent(self.program, 0)[-1], 6)

    def test_trace_and_counters_show_both_functions(self):
        self.client.write_register(104, 5, slave=31)
        frames = self.program.get("/api/v1/lines/floor1/trace?last=20")[1]["frames"]
        why = [f["why"] for f in frames
               if f["direction"] == "sent" and bytes.fromhex(f["bytes"])[:2] == b"\x1f\x10"]
        self.assertRegex(why[-1], "instead of function 6$")
        metrics = self.program.get("/metrics")[1]
        self.assertRegex(metrics, r'translated_requests_total\{line="floor1",station="press",'
                                  r'function="6",sent_as="16"\} [1-9]')
        self.assertRegex(metrics, r'panelgate_requests_total\{line="floor1",station="press",'
                                  r'function="6",outcome="ok"\} [1-9]')

    def test_off_and_guard_leave_the_panel_its_own_refusal(self):
        stations = ("{id: 31, name: press, profile: autonics-gplp-s, translate: off}, "
                    "{id: 30, name: lathe, profile: autonics-gplp-s, guard: true}")
        with harness.configured(config.gateway(config.line(stations=stations),
                                               http=config.ADMIN)) as program:
            with program.client() as client:
                for unit in (31, 30):
                    answer = client.ask(unit, struct.pack(">BHH", 6, 100, 7))
                    self.assertEqual(answer, b"\x86\x01", unit)
                self.assertEqual(sent(program, 31)[-1], 6)
                self.assertEqual(sent(program, 30), [], "refused here")


if __name__ == "__main__":
    unittest.main()
