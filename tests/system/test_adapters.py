"""What a serial device is set to, what it cannot do, and who else has it."""
import pathlib
import tempfile
import termios
import unittest

import config
import harness
from harness import read_registers
from rtu_bus import RtuBus, echo_address

DOWN = b"\x83\x0a"
VALUE = bytes.fromhex("03020005")


class Adapters(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.link = pathlib.Path(folder.name) / "tty"

    def config(self, baud=38400, parity="none", stop_bits=1, rs485="off"):
        tested = config.line("tested", self.link, "{id: 1, name: one}", baud=baud, parity=parity,
                             stop_bits=stop_bits, rs485=f"{{mode: {rs485}}}")
        return config.gateway(tested, config.STEADY_LINE)

    def assert_raw(self, settings, baud, two_stop_bits):
        iflag, oflag, cflag, lflag, characters, speed = settings
        self.assertEqual((iflag & ~termios.INPCK, oflag, lflag), (termios.IGNBRK, 0, 0))
        self.assertEqual(cflag & termios.CSIZE, termios.CS8)
        self.assertEqual(bool(cflag & termios.CSTOPB), two_stop_bits)
        self.assertFalse(cflag & termios.CRTSCTS)
        self.assertEqual(speed, baud)
        self.assertEqual((characters[termios.VMIN], characters[termios.VTIME]), (1, 0))

    def test_P7_every_setting_is_applied_at_every_opening(self):
        with harness.configured(self.config(9600, stop_bits=2)) as program, \
                program.client() as client:
            for opening in (1, 2, 3):
                with RtuBus(self.link, {1: echo_address}) as bus:
                    program.log.wait_for("line up line=tested", opening)
                    self.assertEqual(client.ask(1, read_registers(5)), VALUE)
                    self.assert_raw(bus.settings(), 9600, two_stop_bits=True)
                program.log.wait_for("line down line=tested why=.*is gone", opening)

    def test_a_device_that_drops_parity_is_used_and_warned_of_once(self):
        with harness.configured(self.config(19200, "even")) as program, program.client() as client:
            for opening in (1, 2):
                with RtuBus(self.link, {1: echo_address}):
                    program.log.wait_for("line up line=tested", opening)
                    self.assertEqual(client.ask(1, read_registers(5)), VALUE)
                program.log.wait_for("line down line=tested why=.*is gone", opening)
            self.assertEqual(program.log.text().count("parity was not taken"), 1)

    def test_a_device_takes_any_integer_rate(self):
        with RtuBus(self.link, {1: echo_address}), \
                harness.configured(self.config(12345)) as program, program.client() as client:
            self.assertEqual(client.ask(1, read_registers(5)), VALUE)
            self.assertNotIn("device settings differ", program.log.text())

    def test_P7_an_rs485_mode_that_the_driver_lacks_is_said_and_stops_nobody_else(self):
        reasons = {"kernel": r"its driver cannot switch RS-485 \(TIOCSRS485\); use rs485 mode off",
                   "rts": "it has no RTS that a program can switch"}
        for mode, reason in reasons.items():
            with self.subTest(mode), RtuBus(self.link, {1: echo_address}) as bus, \
                    harness.configured(self.config(rs485=mode)) as program, \
                    program.client() as client:
                program.log.wait_for(f"line down line=tested why=.*{reason}")
                self.assertEqual(client.ask(1, read_registers(5)), DOWN)
                self.assertEqual(client.ask(31, read_registers(0))[0], 3)
                state = program.get("/api/v1/lines/tested")[1]["state"]
                self.assertRegex(state, f"down: cannot open .*{reason}")
                self.assertEqual(bus.frames(), [])

    def test_a_device_in_use_names_who_has_it(self):
        with RtuBus(self.link, {1: echo_address}), \
                harness.configured(self.config()) as first, first.client() as client:
            self.assertEqual(client.ask(1, read_registers(5)), VALUE)
            with harness.configured(self.config()) as second:
                second.log.wait_for(
                    f"line down line=tested why=.*process {first.process.pid} holds it")
            self.assertEqual(client.ask(1, read_registers(5)), VALUE)


if __name__ == "__main__":
    unittest.main()
