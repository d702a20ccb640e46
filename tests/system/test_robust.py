"""Bad and many clients against simulated panels; what the program costs."""
import contextlib
import pathlib
import random
import socket
import struct
import time
import unittest

import config
import harness
from harness import adu, read_registers

PATIENT = config.gateway(config.line(queue="{limit: 1000, deadline: 60s}"), modbus=config.MANY)
FIVE_WORDS = bytes.fromhex("030A000A0014001E00280032")  # UW0..UW4 of the manual's example
CONNECTIONS = 300
MEMORY_LIMIT = 40 * 1024  # KiB


class ManyClients(unittest.TestCase):
    def test_P3_P9_300_connections_with_a_request_each_are_all_answered(self):
        with harness.configured(PATIENT) as program, contextlib.ExitStack() as stack:
            port = program.modbus_port()
            clients = [stack.enter_context(harness.Client(port)) for _ in range(CONNECTIONS)]
            writes = [struct.pack(">BHHBH", 16, 1000 + n, 1, 2, n) for n in range(CONNECTIONS // 2)]
            readers = clients[len(writes):]
            for client, write in zip(clients, writes):
                client.send(31, write)
            for client in readers:
                client.send(31, read_registers(0, 5))
            for client, write in zip(clients, writes):
                self.assertEqual(client.receive()[2], write[:5])
            for client in readers:
                self.assertEqual(client.receive()[2], FIVE_WORDS)
            words = self.registers(clients[0], 1000, 125) + self.registers(clients[0], 1125, 25)
            self.assertEqual(words, list(range(CONNECTIONS // 2)))

    def registers(self, client, address, count):
        reply = client.ask(31, read_registers(address, count))
        return list(struct.unpack(f">BB{count}H", reply)[2:])

    def test_P3_P9_a_hundred_pipelined_requests_are_answered_in_order_none_is_busy(self):
        with harness.configured(PATIENT) as program, program.client() as client:
            client.send_bytes(b"".join(
                adu(n, 31, read_registers(n, 5)) for n in range(100)))
            replies = [client.receive() for _ in range(100)]
            self.assertEqual([transaction for transaction, _, _ in replies], list(range(100)))
            self.assertEqual({pdu[:2] for _, _, pdu in replies}, {b"\x03\x0a"})


class BadClients(unittest.TestCase):
    """A good client is asked after each, on a connection that is open all the time."""

    @classmethod
    def setUpClass(cls):
        cls.program = cls.enterClassContext(
            harness.configured(config.gateway(config.line(), http=config.ADMIN)))
        cls.http_port = cls.program.http_port()
        cls.good = cls.program.client()
        cls.addClassCleanup(cls.good.close)

    def tearDown(self):
        self.assertEqual(self.good.ask(31, read_registers(0, 5)), FIVE_WORDS)
        self.assertEqual(self.program.get("/healthz")[0], 200)
        self.assertIsNone(self.program.process.poll())

    def test_an_adu_may_come_byte_by_byte(self):
        with self.program.client() as client:
            client.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            for byte in adu(1, 31, read_registers(0, 5)):
                client.send_bytes(bytes([byte]))
            self.assertEqual(client.receive(), (1, 31, FIVE_WORDS))

    def test_a_length_that_cannot_be_closes_that_connection(self):
        for length in (0, 1, 255, 256, 65535):
            with self.subTest(length=length), self.program.client() as client:
                client.send_bytes(struct.pack(">HHHB", 1, 0, length, 31))
                self.assertTrue(client.is_closed_by_peer())

    def test_a_foreign_protocol_is_skipped_then_closes(self):
        foreign = struct.pack(">HHHB", 1, 7, 6, 31) + read_registers(0, 5)
        with self.program.client() as client:
            client.send_bytes(foreign + foreign)
            self.assertEqual(client.ask(31, read_registers(0, 5)), FIVE_WORDS)
            client.send_bytes(foreign * 3)
            self.assertTrue(client.is_closed_by_peer())

    def test_a_half_adu_closes_its_connection_in_the_end(self):
        with self.program.client() as client:
            client.send_bytes(adu(1, 31, read_registers(0, 5))[:9])
            self.assertEqual(self.good.ask(31, read_registers(0, 5)), FIVE_WORDS)
            self.assertTrue(client.is_closed_by_peer())

    def test_requests_that_contradict_themselves_are_answered_03(self):
        with self.program.client() as client:
            before = self.program.trace("floor1")
            for pdu in ("03", "0300", "030000000500", "03000000", "03000000FF",
                        "1000000002040001", "0F000000080200"):
                with self.subTest(pdu=pdu):
                    asked = bytes.fromhex(pdu)
                    self.assertEqual(client.ask(31, asked), bytes([asked[0] | 0x80, 3]))
            self.assertEqual(self.program.trace("floor1"), before)

    def test_random_bytes_harm_nobody(self):
        chance = random.Random(20)
        for _ in range(50):
            with self.program.client() as client, contextlib.suppress(OSError):
                client.send_bytes(chance.randbytes(chance.randrange(1, 600)))
                client.socket.shutdown(socket.SHUT_WR)
            self.assertEqual(self.good.ask(31, read_registers(0, 5)), FIVE_WORDS)

    def test_http_garbage_harms_nobody(self):
        chance = random.Random(21)
        hopeless = [b"GET\r\n\r\n", b"GET / HTTP/9.9\r\n\r\n", b"\x16\x03\x01\x02\x00\x01",
                    b"GET / HTTP/1.1\r\n" + b"x: " + b"y" * 100_000 + b"\r\n\r\n",
                    b"PUT /api/v1/stations/press/devices/UW100 HTTP/1.1\r\nHost: localhost\r\n"
                    b"Content-Length: 99999999999\r\n\r\n",
                    b"GET /%zz HTTP/1.1\r\nHost: localhost\r\n\r\n",
                    b"GET /api/v1/stations/%00%ff HTTP/1.1\r\nHost: localhost\r\n\r\n"]
        hopeless += [chance.randbytes(chance.randrange(1, 3000)) for _ in range(30)]
        for data in hopeless:
            with socket.create_connection(("127.0.0.1", self.http_port), harness.PATIENCE) as client:
                with contextlib.suppress(OSError):
                    client.sendall(data)
                    client.shutdown(socket.SHUT_WR)
                answer = read_to_the_end(client)
                self.assertIn(answer[:10], (b"", b"HTTP/1.1 4", b"HTTP/1.1 5"), data[:60])
            self.assertEqual(self.program.get("/healthz")[0], 200)

    def test_bodies_that_are_no_values_are_told_so(self):
        for body, status in ((None, 400), ([], 400), ({}, 400), ({"values": "x"}, 400),
                             ({"values": []}, 400), ({"values": [70000]}, 400),
                             ({"values": [1.5]}, 400)):
            with self.subTest(body=body):
                seen, problem = self.program.rest("PUT", "/api/v1/stations/press/devices/UW100", body)
                self.assertIn(seen, (400, 422), problem)
                self.assertEqual(problem["status"], seen)
        for path, status in (("/api/v1/stations/nobody", 404), ("/api/v1/nothing", 404),
                             ("/api/v1/stations/press/devices/XY1", 422)):
            self.assertIn(self.program.get(path)[0], (status, 404), path)


def read_to_the_end(client):
    data = b""
    with contextlib.suppress(ConnectionResetError):
        while more := client.recv(65536):
            data += more
    return data


class Cost(unittest.TestCase):
    def test_the_demo_is_ready_soon_and_small(self):
        start = time.monotonic()
        with harness.demo() as program:
            self.assertEqual(program.get("/readyz")[0], 200)
            ready = time.monotonic() - start
            with program.client() as client:
                for _ in range(50):
                    client.ask(31, read_registers(0, 5))
            program.get("/metrics")
            status = pathlib.Path(f"/proc/{program.process.pid}/status").read_text()
            kib = int(status.split("VmRSS:")[1].split()[0])
            print(f"\nstart to /readyz {ready * 1000:.0f} ms, resident {kib / 1024:.1f} MiB",
                  flush=True)
            if not harness.SANITIZED:
                self.assertLess(kib, MEMORY_LIMIT)


if __name__ == "__main__":
    unittest.main()
