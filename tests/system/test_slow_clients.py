"""Clients that read later than the answers come, and clients that close their sending side and then
read: whatever was taken of them is answered."""
import pathlib
import socket
import struct
import tempfile
import threading
import unittest

import config
import harness
from harness import adu, read_registers, rtu, write_register
from rtu_bus import Pieces, RtuBus, echo_address

ACCEPTED = 80  # of one connection: 16 in flight and 64 that wait
MANY = 2000  # replies of 209 bytes: more than any socket buffer in here holds
THINKING = 0.01  # seconds


def answer(request):
    """The PDU that the panels below give to the PDU of a request."""
    return echo_address(rtu(1, request))


def thinks(frame):
    return Pieces([(THINKING, rtu(frame[0], echo_address(frame)))])


class SlowClients(unittest.TestCase):
    def setUp(self):
        folder = self.enterContext(tempfile.TemporaryDirectory())
        self.link = pathlib.Path(folder) / "tty"

    def started(self, panel):
        """(bus, program), both until the end of the test; stations 1 and 2 are such panels."""
        bus = self.enterContext(RtuBus(self.link, {1: panel, 2: panel}))
        program = self.enterContext(harness.configured(config.gateway(config.line(
            device=self.link, stations=config.station_ids((1, 2), ", profile: generic"),
            baud=921600, timing="{frame_gap: 100us}"))))
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

    def test_P3_a_client_that_closed_its_sending_side_is_answered_by_the_panels(self):
        bus, program = self.started(thinks)
        requests = [(read_registers if i % 2 else write_register)(50 * i, i + 1)
                    for i in range(ACCEPTED)]
        with program.client() as client:
            client.send_bytes(b"".join(adu(i, 1, pdu) for i, pdu in enumerate(requests)))
            client.socket.shutdown(socket.SHUT_WR)
            for i, pdu in enumerate(requests):
                self.assertEqual(client.receive(), (i, 1, answer(pdu)))
            self.assertEqual(client.socket.recv(1), b"", "closed, not reset")
        written = [struct.unpack(">H", f.bytes[4:6])[0] for f in bus.frames(1) if f.bytes[1] == 6]
        self.assertEqual(written, list(range(1, ACCEPTED + 1, 2)), "each once, in order")

    def test_P2_one_that_has_left_altogether_takes_with_it_what_was_not_sent(self):
        may_answer = threading.Event()
        self.addCleanup(may_answer.set)

        def held(frame):
            return echo_address(frame) if may_answer.wait(harness.PATIENCE) else None

        bus, program = self.started(held)
        with program.client() as client:
            client.send_bytes(b"".join(adu(i, 1, write_register(i, i)) for i in range(ACCEPTED)))
            bus.wait_for(1)
        may_answer.set()
        with program.client() as other:
            for i in range(ACCEPTED):
                other.ask(2, read_registers(i))
        # Its system answers the first reply with a reset, and meanwhile the next one may have left.
        self.assertLess(len(bus.frames(1)), ACCEPTED / 8)


if __name__ == "__main__":
    unittest.main()
