"""The gateway as a device: unit 255 answers foreign clients like a panel would, and its map is printed
by `panelgate profiles gateway`."""
import unittest

from pymodbus.client import ModbusTcpClient
from pymodbus.mei_message import ReadDeviceInformationRequest

import config
import harness

UNIT = 255
SILENT = "{id: 17, name: io, profile: autonics-arm, simulate: {dead: true}}"


def block(unit):
    return 1000 + 16 * unit


class OwnUnit(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        running = harness.configured(config.gateway(
            config.line(stations=f"{config.PRESS}, {SILENT}",
                        timing="{response_timeout: 60ms}"),
            modbus=config.FREE_PORT + ", diagnostics_unit: 255"))
        cls.program = running.__enter__()
        cls.addClassCleanup(running.__exit__, None, None, None)
        cls.client = ModbusTcpClient("127.0.0.1", port=cls.program.modbus_port())
        cls.addClassCleanup(cls.client.close)

    def registers(self, address, count):
        reply = self.client.read_holding_registers(address, count, slave=UNIT)
        self.assertFalse(reply.isError(), reply)
        return reply.registers

    def test_any_read_inside_the_map_succeeds(self):
        for address in range(0, 5000, 125):
            self.assertEqual(len(self.registers(address, 125)), 125)
        self.assertEqual(
            self.client.read_input_registers(0, 2, slave=UNIT).registers, [2, 1])
        self.assertEqual(
            self.client.read_holding_registers(4999, 2, slave=UNIT).exception_code, 2)
        self.assertEqual(self.client.write_register(0, 1, slave=UNIT).exception_code, 1)

    def test_each_station_shows_how_it_does(self):
        asked = self.client.read_holding_registers(0, 5, slave=31)
        self.assertEqual(asked.registers, [10, 20, 30, 40, 50])
        self.assertEqual(self.client.read_holding_registers(0, 1, slave=17).exception_code, 0x0B)
        state, line, station, _, high, low, _, good = self.registers(block(31), 8)
        self.assertEqual((state, line, station), (2, 1, 31))
        self.assertLess(high << 16 | low, 1000 * harness.PATIENCE)
        self.assertGreaterEqual(good, 1)
        silent = self.registers(block(17), 16)
        self.assertIn(silent[0], (3, 4))
        self.assertEqual(silent[4:6], [0xFFFF, 0xFFFF], "it has never answered")
        self.assertGreaterEqual(silent[11], 1)
        self.assertEqual(self.registers(block(5), 16), [0] * 16)
        bits = self.client.read_discrete_inputs(0, 256, slave=UNIT).bits
        self.assertEqual([unit for unit, on in enumerate(bits) if on], [31])

    def test_it_identifies_itself(self):
        basic = self.client.execute(ReadDeviceInformationRequest(1, 0, unit=UNIT)).information
        self.assertEqual(basic[0], b"panelgate")
        whole = self.client.execute(ReadDeviceInformationRequest(3, 0, unit=UNIT)).information
        self.assertEqual({0, 1, 2, 3, 4, 5, 6}, set(whole))
        self.assertEqual(whole[3].decode(), self.program.url("/").replace(
            str(self.program.http_port()), "0"), "as configured")

    def test_its_map_is_printed(self):
        printed = harness.run("profiles", "gateway")
        self.assertEqual(printed.returncode, 0, printed.stderr)
        self.assertIn("1000 + 16u", printed.stdout)
        self.assertRegex(harness.run("profiles").stdout, "(?m)^gateway ")


if __name__ == "__main__":
    unittest.main()
