"""Panels with firmware from before June 2005, whose CRC has its high byte first, beside newer ones:
on a paced line that knows nothing of the gateway, simulated, and found by a scan."""
import asyncio
import struct
import time
import unittest

import config
import harness
from harness import read_registers
from test_scan import scan, simulated
from zoo_line import WRITABLE, counted, odd_line, outcome, read_all, write_register

OLD = 2
UNITS = range(1, 4)
STATIONS = "{id: 1}, {id: 2, crc_order: high_first}, {id: 3}"
SIMULATED = config.gateway(config.line(stations="""
      {id: 5, name: mixer, profile: autonics-gp-2005-old}, {id: 31, name: press,
       profile: autonics-gplp-s}"""), http=config.ADMIN)


class BothOnOneLine(unittest.TestCase):
    def test_P1_each_is_understood_also_when_the_old_one_is_late(self):
        with odd_line(38400, UNITS, {OLD: "crcold,every5-200x3"}, stations=STATIONS) as line:
            readers = asyncio.run(read_all(line.program.modbus_port(), UNITS, 3))
            line.zoo.set(OLD, "crcold")
            with line.program.client() as client:
                written = [outcome(client, unit, write_register(WRITABLE, 7)) for unit in UNITS]
            executed = {w.unit for w in line.zoo.writes()}
        for unit, reader in readers.items():
            seen = reader.summary()
            self.assertEqual(seen.wrong, 0, unit)
            self.assertGreater(seen.good, 3, unit)
        self.assertEqual((counted(written), executed), ({"good": 3}, set(UNITS)))

    def test_without_the_key_the_old_one_is_silent_and_the_advice_names_the_key(self):
        with odd_line(38400, UNITS, {OLD: "crcold"}) as line, line.program.client() as client:
            found, end = [], time.monotonic() + harness.PATIENCE
            while not found and time.monotonic() < end:
                for unit in UNITS:
                    outcome(client, unit, read_registers(0))
                found = line.program.get("/api/v1/lines/zoo")[1]["findings"]
        self.assertEqual([(f["cause"], f["station"]) for f in found], [("station-silent", OLD)])
        self.assertIn("`crc_order: high_first`", found[0]["advice"])


class Simulated(unittest.TestCase):
    def test_an_old_panel_beside_a_new_one(self):
        with harness.configured(SIMULATED) as program, program.client() as client:
            reply = client.ask(5, read_registers(30, 5))
            self.assertEqual(reply, struct.pack(">BB5H", 3, 10, 10, 20, 30, 40, 50))
            self.assertEqual(client.ask(31, read_registers(0, 2)), b"\x03\x04\x00\x0a\x00\x14")
            written = struct.pack(">BHH", 6, 100, 9)
            self.assertEqual(client.ask(5, written), written)
            frames = [frame for _, frame in program.trace("floor1") if frame[0] == 5]
        good = harness.rtu(5, read_registers(30, 5))
        self.assertIn(good[:-2] + good[:-3:-1], frames)
        self.assertNotIn(good, frames)

    def test_a_scan_finds_it_beside_the_others(self):
        stations = "{id: 5, profile: autonics-gp-2005-old}, {id: 6, profile: autonics-gp-2005}"
        with simulated(config.line("a", stations=stations)) as links:
            code, out, _ = scan(links["a"], "--stations", "4-7", "--baud", "38400", "--yaml")
        self.assertEqual(code, 0, out)
        self.assertIn("{id: 5, name: station-5, profile: autonics-gp-2005-old, "
                      "crc_order: high_first}", out)
        self.assertIn("{id: 6, name: station-6, profile: autonics-gp-2005}", out)

    def test_a_mixed_line_says_who_hears_broadcasts(self):
        with harness.configured(SIMULATED) as program:
            program.log.wait_for("do not hear them")


if __name__ == "__main__":
    unittest.main()
