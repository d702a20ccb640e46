"""Listeners of other framings: RTU and ASCII over TCP, Modbus/TCP in datagrams. Foreign clients read
and write through them, and what they send is on the wire once."""
import os
import re
import socket
import struct
import subprocess
import threading
import tty
import unittest

from pymodbus.client import ModbusTcpClient, ModbusUdpClient
from pymodbus.transaction import ModbusAsciiFramer, ModbusRtuFramer

import config
import harness

FILLER = "{id: 1, name: filler, profile: omron-cp2e}"
NEAR = 'listen: "127.0.0.1:0"'
TCP, RTU, ASCII, LOWER = 1, 2, 3, 4  # the listeners, in their order
LISTENERS = "}, {".join([NEAR + ", udp: true", NEAR + ", framing: rtu", NEAR + ", framing: ascii",
                         NEAR + ", framing: ascii, ascii_lower_case: take"])
GATEWAY = config.gateway(
    config.line(stations=f"{config.PRESS}, {FILLER}", unlisted_stations="refuse"),
    modbus=LISTENERS, http=config.ADMIN)
READ_ONE = harness.read_registers(0)


def ascii_frame(station, pdu):
    data = bytes([station]) + pdu
    return b":" + (data + bytes([-sum(data) & 0xFF])).hex().upper().encode() + b"\r\n"


class Raw:
    """A connection, and no opinion of what goes over it."""

    def __init__(self, port, own_address="127.0.0.1"):
        self.socket = socket.create_connection(("127.0.0.1", port), harness.PATIENCE,
                                               (own_address, 0))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def send(self, data):
        self.socket.sendall(data)

    def exactly(self, count):
        data = b""
        while len(data) < count and (more := self.socket.recv(count - len(data))):
            data += more
        return data

    def is_closed(self):
        return self.socket.recv(1) == b""


class PtyToTcp:
    """What is written to the pty goes to the listener, and back: for clients that know only serial
    devices."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port))
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave)
        self.device = os.ttyname(self.slave)
        for source, target in ((self._from_pty, self.socket.sendall),
                               (lambda: self.socket.recv(512), self._to_pty)):
            threading.Thread(target=self._carry, args=(source, target), daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.shutdown(socket.SHUT_RDWR)
        os.close(self.slave)

    def _from_pty(self):
        try:
            return os.read(self.master, 512)
        except OSError:  # nobody has the other end any more
            return b""

    def _to_pty(self, data):
        os.write(self.master, data)

    @staticmethod
    def _carry(read, write):
        try:
            while data := read():
                write(data)
        except OSError:
            pass


class Framings(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        running = harness.configured(GATEWAY)
        cls.program = running.__enter__()
        cls.addClassCleanup(running.__exit__, None, None, None)

    def port(self, listener):
        return self.program.modbus_port(listener)

    def foreign_clients(self):
        at = {"host": "127.0.0.1", "timeout": 5}
        yield "tcp", ModbusTcpClient(port=self.port(TCP), **at)
        yield "udp", ModbusUdpClient(port=self.port(TCP), **at)
        yield "rtu", ModbusTcpClient(port=self.port(RTU), framer=ModbusRtuFramer, **at)
        yield "ascii", ModbusTcpClient(port=self.port(ASCII), framer=ModbusAsciiFramer, **at)

    def sent_so_far(self):
        """A place in the line's trace, for sent_since()."""
        return self.program.get("/api/v1/lines/floor1/trace?last=1")[1]["next"]

    def sent_since(self, place):
        """The requests that have gone out since."""
        status, body = self.program.get(f"/api/v1/lines/floor1/trace?since={place}")
        self.assertEqual(status, 200, body)
        return [bytes.fromhex(frame["bytes"]) for frame in body["frames"]
                if frame["direction"] == "sent"]

    def protocol_errors(self):
        name = "panelgate_tcp_protocol_errors_total"
        return [line for line in self.program.get("/metrics")[1].splitlines() if line.startswith(name)]

    def writes_since(self, place):
        return [frame for frame in self.sent_since(place) if frame[1] in (5, 6, 15, 16)]

    def test_pymodbus_reads_and_writes_in_each_framing(self):
        for number, (name, client) in enumerate(self.foreign_clients(), start=10):
            with self.subTest(framing=name), client:
                before = self.sent_so_far()
                values = [number, 0xFFFF, 0, 0x3A0D]
                self.good(client.write_registers(700, values, slave=1))
                self.assertEqual(
                    self.good(client.read_holding_registers(700, 4, slave=1)).registers, values)
                self.good(client.write_register(704, number, slave=1))
                self.assertEqual(
                    self.good(client.read_holding_registers(704, 1, slave=1)).registers, [number])
                self.good(client.write_coils(32, [True, False, True], slave=1))
                self.assertEqual(
                    self.good(client.read_coils(32, 3, slave=1)).bits[:3], [True, False, True])
                self.assertEqual(len(self.writes_since(before)), 3)

    def test_an_exception_is_told_in_each_framing(self):
        for name, client in self.foreign_clients():
            with self.subTest(framing=name), client:
                reply = client.read_holding_registers(0, 1, slave=200)
                self.assertEqual(reply.exception_code, 0x0A)
                reply = client.read_holding_registers(60000, 1, slave=31)
                self.assertIn(reply.exception_code, (2, 3), "the panel's own")

    def good(self, reply):
        self.assertFalse(reply.isError(), reply)
        return reply

    def test_libmodbus_speaks_rtu_through_a_serial_device(self):
        with PtyToTcp(self.port(RTU)) as bridge:
            poll = ["mbpoll", "-m", "rtu", "-b", "38400", "-P", "none", "-a", "1", "-0", "-1",
                    "-t", "4", "-r", "300", bridge.device]
            for values in (["7", "65535", "1"], ["8"]):
                wrote = subprocess.run([*poll, *values], capture_output=True, text=True,
                                       timeout=harness.PATIENCE, check=False)
                self.assertEqual(wrote.returncode, 0, wrote.stdout + wrote.stderr)
            read = subprocess.run([*poll[:-1], "-c", "3", bridge.device], capture_output=True,
                                  text=True, timeout=harness.PATIENCE, check=False)
            self.assertEqual(read.returncode, 0, read.stdout + read.stderr)
            found = re.findall(r"(?m)^\[\d+\]:\s+(\d+)", read.stdout)
            self.assertEqual(found, ["8", "65535", "1"])

    def test_p3_pipelined_requests_are_answered_in_order_through_noise(self):
        for listener, wrap in ((RTU, harness.rtu), (ASCII, ascii_frame)):
            with self.subTest(listener=listener), Raw(self.port(listener)) as client:
                for i in range(30):
                    client.send(wrap(1, harness.write_register(400 + i, 1000 * listener + i)))
                for i in range(30):
                    reply = wrap(1, harness.write_register(400 + i, 1000 * listener + i))
                    self.assertEqual(client.exactly(len(reply)), reply)
                for i in range(0, 30, 3):
                    client.send(b"\x10\xff" + wrap(1, harness.read_registers(400 + i)))
                    reply = wrap(1, struct.pack(">BBH", 3, 2, 1000 * listener + i))
                    self.assertEqual(client.exactly(len(reply)), reply)

    def test_p2_nothing_that_stands_in_a_damaged_write_is_written(self):
        with Raw(self.port(RTU)) as client:
            before = self.sent_so_far()
            inside = harness.rtu(1, harness.write_register(700, 48879))
            data = b"\0\x07" + inside
            pdu = struct.pack(">BHHB", 16, 710, len(data) // 2, len(data)) + data
            damaged = bytearray(harness.rtu(1, pdu))
            damaged[-1] ^= 1
            client.send(damaged)
            client.send(harness.rtu(1, harness.read_registers(700)))
            reply = harness.rtu(1, b"\x03\x02\0\0")
            self.assertEqual(client.exactly(len(reply)), reply)
            self.assertEqual(self.writes_since(before), [])

    def test_p9_each_of_many_datagrams_is_answered_and_none_is_an_error(self):
        errors = self.protocol_errors()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
            client.settimeout(harness.PATIENCE)
            client.connect(("127.0.0.1", self.port(TCP)))
            for i in range(80):  # what a connection may have open
                client.send(harness.adu(i, 1, harness.read_registers(i)))
            answers = [client.recv(300) for _ in range(80)]
        self.assertEqual([struct.unpack_from(">H", one)[0] for one in answers], list(range(80)))
        self.assertTrue(all(one[7:9] == b"\x03\x02" for one in answers))
        self.assertEqual(self.protocol_errors(), errors)

    def test_nobody_answers_a_broadcast(self):
        for listener, wrap in ((RTU, harness.rtu), (ASCII, ascii_frame)):
            with self.subTest(listener=listener), Raw(self.port(listener)) as client:
                before = self.sent_so_far()
                client.send(wrap(0, harness.write_register(500, listener)))
                client.send(wrap(1, READ_ONE))
                head = wrap(1, b"\x03\x02")[:3]
                self.assertEqual(client.exactly(len(head)), head)
                broadcast = harness.rtu(0, harness.write_register(500, listener))
                self.assertEqual(self.writes_since(before), [broadcast])

    def test_lower_case_digits_are_refused_or_taken(self):
        request = ascii_frame(1, harness.read_registers(0x01AB)).lower()
        with Raw(self.port(LOWER)) as client:
            client.send(request)
            self.assertEqual(client.exactly(5), b":0103")
        with Raw(self.port(ASCII)) as client:
            client.send(request + ascii_frame(200, READ_ONE))
            self.assertEqual(client.exactly(5), b":C883", "only the second is a request")

    def test_who_speaks_another_framing_is_told_and_the_bus_hears_nothing(self):
        before = self.sent_so_far()
        asked = harness.read_registers(0, 6)
        spoken = {TCP: harness.adu(7, 1, asked), RTU: harness.rtu(1, asked),
                  ASCII: ascii_frame(1, asked)}
        names = {TCP: "tcp", RTU: "rtu", ASCII: "ascii"}
        for listener in names:
            for speaks in names:
                if listener == speaks:
                    continue
                with self.subTest(listener=names[listener], speaks=names[speaks]):
                    # The log does not tell the same of one address again and again.
                    with Raw(self.port(listener), f"127.0.{listener}.{speaks}") as client:
                        client.send(spoken[speaks])
                        self.assertTrue(client.is_closed())
                    self.program.log.wait_for(
                        f"needs a listener with framing: {names[speaks]}; "
                        f"this one has framing: {names[listener]}")
        self.assertEqual(self.sent_since(before), [])

    def test_a_read_of_unit_22_is_no_tls_hello(self):
        for first in (0, 100, 0x1FF, 0x4FF):
            with Raw(self.port(RTU)) as client:
                client.send(harness.rtu(22, harness.read_registers(first)))
                self.assertEqual(client.exactly(5), harness.rtu(22, b"\x83\x0a"), first)

    def test_p2_a_datagram_that_comes_twice_is_one_frame_and_one_answer(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
            client.settimeout(harness.PATIENCE)
            client.connect(("127.0.0.1", self.port(TCP)))
            before = self.sent_so_far()
            write = harness.write_register(600, 77)
            for _ in range(5):
                client.send(harness.adu(1, 1, write))
            client.send(harness.adu(2, 1, harness.read_registers(600)))
            self.assertEqual(client.recv(300), harness.adu(1, 1, write))
            self.assertEqual(client.recv(300), harness.adu(2, 1, b"\x03\x02\x00\x4d"))
            self.assertEqual(self.writes_since(before), [harness.rtu(1, write)])

    def test_clients_of_all_framings_share_the_line(self):
        wrong = []

        def work(name, client, first):
            with client:
                for i in range(25):
                    value = first + i
                    wrote = client.write_register(first, value, slave=1)
                    read = client.read_holding_registers(first, 1, slave=1)
                    if wrote.isError() or read.isError() or read.registers != [value]:
                        wrong.append((name, i, wrote, read))
        clients = [*self.foreign_clients(), *self.foreign_clients()]
        threads = [threading.Thread(target=work, args=(name, client, 1000 + 100 * i))
                   for i, (name, client) in enumerate(clients)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(wrong, [])


if __name__ == "__main__":
    unittest.main()
