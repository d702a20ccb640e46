"""A line with two devices: the second one is used while the first cannot be opened."""
import os
import pathlib
import tempfile
import threading
import unittest

import config
import harness
from harness import read_registers
from test_modbus_tcp_device import Device, Hasty
from test_points import until


class Door:
    """A device whose port may be shut and opened again."""

    def __init__(self):
        self.device = Device()
        self.port = self.device.port
        self.device._server.close()
        self.asked = 0
        self.peers = []

    def open(self):
        self.device = Device(self._answer, self.port)
        self.device.__enter__()

    def _answer(self, _, reply):
        self.asked += 1
        return [reply]

    def shut(self):
        self.device.shut()


def two_ways(first, second):
    return config.gateway(f"  - {{name: eth, device: ['modbus-tcp://127.0.0.1:{first.port}', "
                          f"'modbus-tcp://127.0.0.1:{second.port}'], stations: [{{id: 1, name: press}}]}}\n")


class SecondWay(unittest.TestCase):
    def test_the_second_is_used_while_the_first_cannot_be_opened(self):
        first, second = Door(), Door()
        second.open()
        self.addCleanup(second.shut)
        text = two_ways(first, second)
        with harness.configured(text) as program, program.client() as client:
            def is_answered():
                return client.ask(1, read_registers(5, 1))[0] == 3
            until(is_answered)
            self.assertEqual(first.asked, 0)
            self.assertGreater(second.asked, 0)
            first.open()
            self.addCleanup(first.shut)
            program.log.wait_for("first device again line=eth")
            until(lambda: is_answered() and first.asked > 0)
            before = second.asked
            for _ in range(20):
                self.assertTrue(is_answered(), "the way back loses no request")
            self.assertEqual(second.asked, before, "never both")
            first.shut()
            program.log.wait_for("second device line=eth", count=2)
            until(lambda: is_answered() and second.asked > before)

    def test_no_request_is_lost_on_the_way_back(self):
        first, second = Door(), Door()
        second.open()
        self.addCleanup(second.shut)
        text = two_ways(first, second)
        ended, answers = threading.Event(), []
        with harness.configured(text) as program, program.client() as client:
            until(lambda: client.ask(1, read_registers(5, 1))[0] == 3)

            def ask():
                while not ended.is_set():
                    answers.append(client.ask(1, read_registers(5, 1))[0])
            asking = threading.Thread(target=ask)
            asking.start()
            first.open()
            self.addCleanup(first.shut)
            program.log.wait_for("first device again line=eth")
            until(lambda: first.asked > 10)
            ended.set()
            asking.join()
        self.assertEqual(set(answers), {3})

    def test_a_first_device_that_keeps_no_connection_is_not_there(self):
        """A device server may take a second connection only to end it."""
        second = Door()
        second.open()
        self.addCleanup(second.shut)
        with Hasty() as first, harness.configured(two_ways(first, second)) as program, program.client() as client:
            until(lambda: client.ask(1, read_registers(5, 1))[0] == 3)
            before, answers = first.asked, []
            while first.asked < before + 3:
                answers.append(client.ask(1, read_registers(5, 1))[0])
            self.assertEqual(set(answers), {3})

    def test_a_serial_device_that_comes_back(self):
        with tempfile.TemporaryDirectory() as folder:
            master, slave = os.openpty()
            self.addCleanup(os.close, master)
            self.addCleanup(os.close, slave)
            link = pathlib.Path(folder) / "adapter"
            second = Door()
            text = config.gateway(
                f"  - {{name: floor1, device: [{link}, 'tcp://127.0.0.1:{second.port}'], "
                "serial: {baud: 9600, parity: none}, stations: [{id: 1, name: press}]}\n")
            with harness.configured(text) as program:
                program.log.wait_for("second device line=floor1")
                second.open()
                self.addCleanup(second.shut)
                program.log.wait_for(f"line up line=floor1 device=tcp://127.0.0.1:{second.port}")
                link.symlink_to(os.ttyname(slave))
                program.log.wait_for(f"line up line=floor1 device={link}")

    def test_what_two_devices_cannot_be(self):
        for devices, words in (("[/dev/ttyUSB0]", "a list has two devices"),
                               ("[/dev/ttyUSB0, /dev/ttyUSB0]", "both devices are '/dev/ttyUSB0'"),
                               ("[/dev/ttyUSB0, 'modbus-tcp://10.0.0.1:502']", "or none"),
                               ("[sim, /dev/ttyUSB0]", "sim has no second device"),
                               ("[/dev/ttyUSB0, 'tcp://10.0.0.1']", "HOST:PORT")):
            with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
                file.write(config.gateway(f"  - {{name: a, device: {devices}, serial: {{parity: none}}}}\n"))
                file.flush()
                self.assertIn(words, harness.run("check", "-c", file.name).stderr)


if __name__ == "__main__":
    unittest.main()
