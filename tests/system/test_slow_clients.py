"""Clients that read later than the answers come: whatever was taken of them is answered."""
import pathlib
import tempfile
import threading
import unittest

import harness
from harness import adu, read_registers, rtu
from rtu_bus import RtuBus, echo_address

CONFIG = """
lines:
  - name: floor1
    device: %s
    serial: {baud: 921600, data_bits: 8, parity: none, stop_bits: 1}
    timing: {frame_gap: 100us}
    stations: [{id: 1, profile: generic}, {id: 2, profile: generic}]
modbus_tcp: [{listen: "127.0.0.1:0"}]
http: {listen: "127.0.0.1:0"}
"""
MANY = 2000  # replies of 209 bytes: more than any socket buffer in here holds


def answer(request):
    """The PDU that the panels below give to the PDU of a request."""
    return echo_address(rtu(1, request))


class SlowClients(unittest.TestCase):
    def setUp(self):
        folder = self.enterContext(tempfile.TemporaryDirectory())
        self.link = pathlib.Path(folder) / "tty"

    def started(self, panel):
        """(bus, program), both until the end of the test; stations 1 and 2 are such panels."""
        bus = self.enterContext(RtuBus(self.link, {1: panel, 2: panel}))
        program = self.enterContext(harness.configured(CONFIG % self.link))
        program.log.wait_for("line up")
        return bus, program

    def test_P3_P9_a_client_that_reads_later_gets_all_it_asked_for_and_holds_up_nobody(self):
        bus, program = self.started(echo_address)
        requests = [read_registers(i % 500, 100) for i in range(MANY)]
        with harness.Client(program.modbus_port(), receive_buffer=2048) as slow:
            sender = threading.Thread(target=slow.send_bytes, daemon=True, args=(
                b"".join(adu(i, 1, pdu) for i, pdu in enumerate(requests)),))
            sender.start()
            with program.client() as polite:
                for i in range(MANY):
                    self.assertEqual(polite.ask(2, read_registers(i, 1)),
                                     answer(read_registers(i, 1)))
            self.assertLess(len(bus.frames(1)), MANY / 2, "the others would only wait to be read")
            for i, pdu in enumerate(requests):
                self.assertEqual(slow.receive(), (i, 1, answer(pdu)))
            sender.join(harness.PATIENCE)
        self.assertNotIn("does not read", program.log.text())


if __name__ == "__main__":
    unittest.main()
