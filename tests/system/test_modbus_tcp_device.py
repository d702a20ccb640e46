"""Devices on Ethernet as lines: modbus-tcp://HOST:PORT. A foreign server, and one with faults."""
import contextlib
import os
import random
import socket
import ssl
import struct
import subprocess
import sys
import tempfile
import threading
import unittest

import config
import harness
import tls_plant
from harness import read_registers, write_register
from test_points import until

FOREIGN = """
import asyncio, socket
from pymodbus.datastore import ModbusSequentialDataBlock as Block, ModbusServerContext, ModbusSlaveContext
from pymodbus.server import StartAsyncTcpServer
def unit(first):
    return ModbusSlaveContext(hr=Block(0, list(range(first, first + 300))), zero_mode=True)
asyncio.run(StartAsyncTcpServer(ModbusServerContext({1: unit(1000), 2: unit(2000)}, single=False),
                                address=("127.0.0.1", PORT)))
"""


def value_of(unit, address):
    return (unit * 1000 + address) & 0xFFFF


class Device:
    """A Modbus/TCP server: a register holds value_of(). `fault(request)` gives what is sent instead of the
    reply, as a list of bytes; None: the reply; and whether the connection goes on. A context manager."""

    def __init__(self, fault=lambda device, reply: [reply], port=0):
        self.fault = fault
        self.late = None
        self.asked = 0
        self._server = socket.create_server(("127.0.0.1", port))
        self._peers = []
        self.port = self._server.getsockname()[1]

    def __enter__(self):
        threading.Thread(target=self._serve, daemon=True).start()
        return self

    def __exit__(self, *_):
        self._server.close()

    def secure(self, peer):
        """What a connection becomes."""
        return peer

    def shut(self):
        """Takes no connections any more, and ends those that there are."""
        for one in [self._server, *self._peers]:
            with contextlib.suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
            one.close()

    def _serve(self):
        while True:
            try:
                peer, _ = self._server.accept()
            except OSError:
                return
            self._peers.append(peer)
            try:
                peer = self.secure(peer)
            except OSError:
                continue  # refused
            threading.Thread(target=self._answer, args=(peer,), daemon=True).start()

    def _answer(self, peer):
        try:
            stream = peer.makefile("rb")
            while len(head := stream.read(12)) == 12:
                number, _, _, unit, function, address, count = struct.unpack(">HHHBBHH", head)
                values = [value_of(unit, address + i) for i in range(count)]
                pdu = struct.pack(f">BB{count}H", function, 2 * count, *values)
                self.asked += 1
                for part in self.fault(self, struct.pack(">HHHB", number, 0, len(pdu) + 1, unit) + pdu):
                    if part is None:
                        peer.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                        return
                    peer.sendall(part)
        except OSError:
            pass
        finally:
            peer.close()


class Hasty(Device):
    """Takes each connection and ends it at once."""

    def secure(self, peer):
        self.asked += 1
        peer.close()
        raise OSError("its only connection is taken")


class Secure(Device):
    """Modbus/TCP Security: TLS, and a certificate of the client's."""

    def __init__(self, plant):
        super().__init__()
        self.context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        self.context.load_cert_chain(plant.path("localhost.crt"), plant.path("localhost.key"))
        self.context.load_verify_locations(plant.path("ca.crt"))
        self.context.verify_mode = ssl.CERT_REQUIRED

    def secure(self, peer):
        return self.context.wrap_socket(peer, server_side=True)


class Together(Device):
    """Answers each `count` requests of a connection at once, the last one first."""

    def __init__(self, count):
        super().__init__(self._keep)
        self.count = count
        self.kept = []

    def _keep(self, _, reply):
        self.kept.append(reply)
        if len(self.kept) < self.count:
            return []
        replies, self.kept = self.kept[::-1], []
        return replies


def ethernet(port, name="eth", stations="{id: 1, name: hall}, {id: 2, name: meter}", in_flight=1):
    return (f"  - {{name: {name}, device: 'modbus-tcp://127.0.0.1:{port}', retries: 0, in_flight: {in_flight}, "
            f"timing: {{response_timeout: 100ms}}, stations: [{stations}]}}\n")


class Ethernet(unittest.TestCase):
    def test_a_foreign_server_is_read_written_polled_and_scanned(self):
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
        server = subprocess.Popen([sys.executable, "-c", FOREIGN.replace("PORT", str(port))])
        self.addCleanup(server.wait)
        self.addCleanup(server.terminate)
        stations = "{id: 1, name: hall, points: [{name: t, at: '400101', every: 50ms}]}, {id: 2, name: meter}"
        text = config.gateway(config.line(), ethernet(port, stations=stations),
                              modbus="listen: '127.0.0.1:0', units: {1: eth/1, 2: eth/2, 31: floor1/31}")
        with harness.configured(text) as program:
            program.log.wait_for("line up line=eth")
            with program.client() as client:
                self.assertEqual(client.ask(1, read_registers(5, 2)), bytes([3, 4]) + struct.pack(">HH", 1005, 1006))
                self.assertEqual(client.ask(2, write_register(7, 4242)), write_register(7, 4242))
                self.assertEqual(client.ask(2, read_registers(7, 1)), bytes([3, 2]) + struct.pack(">H", 4242))
                self.assertEqual(client.ask(31, read_registers(0, 1))[0], 3, "the serial line beside it")
            until(lambda: program.get("/api/v1/stations/hall/points/t")[1]["value"] == 1100)
        found = harness.run("scan", f"modbus-tcp://127.0.0.1:{port}", "--stations", "1-4")
        self.assertRegex(found.stdout, "2 stations")

    def test_a_late_reply_never_answers_another_request(self):
        def fault(device, reply):
            if device.asked == 1:
                device.late = reply
                return []  # it comes later, in front of the next reply
            return [device.late, reply] if device.asked == 2 else [reply]
        with Device(fault) as device, harness.configured(self.plant(device)) as program, \
                program.client() as client:
            self.assertEqual(client.ask(1, read_registers(10, 1)), bytes([0x83, 0x0B]))
            self.assertEqual(client.ask(1, read_registers(20, 1)), bytes([3, 2]) + struct.pack(">H", 1020))

    def plant(self, *devices, in_flight=1):
        lines = [ethernet(device.port, f"eth{i}", f"{{id: 1, name: a{i}}}, {{id: 2, name: b{i}}}", in_flight)
                 for i, device in enumerate(devices)]
        units = ", ".join(f"{10 * i + n}: eth{i}/{n}" for i in range(len(devices)) for n in (1, 2))
        return config.gateway(*lines, modbus=f"listen: '127.0.0.1:0', units: {{{units}}}")

    def test_faults_of_all_kinds_give_no_wrong_value_and_one_answer_each(self):
        for in_flight, clients in ((1, 1), (8, 8)):
            with self.subTest(in_flight=in_flight):
                self.faults(in_flight, clients)

    def faults(self, in_flight, clients):
        chance = random.Random(7)

        def fault(device, reply):
            kind = chance.randrange(20)
            if kind == 0:  # of nobody
                return [bytes([reply[0] ^ 0x40]) + reply[1:]]
            if kind == 1:
                return [reply, reply]
            if kind == 2:  # half of it, and the end
                return [reply[:len(reply) // 2], None]
            if kind == 3:  # no Modbus/TCP
                return [b"HTTP/1.1 400 Bad Request\r\n\r\n"]
            if kind == 4:
                device.late = reply
                return []
            if kind == 5 and device.late:
                return [device.late, reply]
            return [reply[:3], reply[3:]] if kind == 6 else [reply]
        with Device(fault) as device, Device() as sound, \
                harness.configured(self.plant(device, sound, in_flight=in_flight)) as program:
            finished = []

            def ask(base, times):
                good = asked = 0
                with program.client() as client:
                    while asked < times or good < 20:  # a line that is down refuses many in no time
                        unit, address = 1 + asked % 2, asked * 7 % 5000
                        pdu = client.ask(base + unit, read_registers(address, 3))
                        asked += 1
                        good += pdu[0] == 3
                        if pdu[0] == 3:
                            self.assertEqual(pdu[2:], struct.pack(">3H", *(value_of(unit, address + k)
                                                                           for k in range(3))))
                        else:
                            self.assertIn(pdu[1], (0x0A, 0x0B))
                            self.assertLess(base, 10, "the sound device")
                finished.append(base)
            asking = [threading.Thread(target=ask, args=(base, times)) for base, times in ((0, 60), (10, 300))
                      for _ in range(clients)]
            for one in asking:
                one.start()
            for one in asking:
                one.join()
            self.assertEqual(sorted(finished), [0] * clients + [10] * clients)

    def test_many_requests_are_on_their_way_at_once(self):
        # The device answers none of the first four before it has them all: each in a connection's order.
        with Together(4) as device, harness.configured(self.plant(device, in_flight=4)) as program:
            clients = [program.client() for _ in range(4)]
            for i, client in enumerate(clients):
                client.send(1, read_registers(10 * i, 1))
            for i, client in enumerate(clients):
                self.assertEqual(client.receive()[2], bytes([3, 2]) + struct.pack(">H", 1000 + 10 * i))
                client.close()

    def test_tls_to_a_device(self):
        with tls_plant.plant() as made, tls_plant.plant() as other, Secure(made) as device:
            def secured(ca, name="scada"):
                keys = f"tls: {{ca: {ca}, certificate: {made.path(name + '.crt')}, key: {made.path(name + '.key')}}}, "
                return config.gateway(ethernet(device.port, in_flight=4).replace("retries: 0", keys + "retries: 0"))
            with harness.configured(secured(made.path("ca.crt"))) as program, program.client() as client:
                for i in range(50):
                    until(lambda: client.ask(1, read_registers(i, 100))[0] == 3)
                self.assertEqual(client.ask(1, read_registers(7, 1)), bytes([3, 2]) + struct.pack(">H", 1007))
            with harness.configured(secured(other.path("ca.crt"))) as program:
                program.log.wait_for("line down line=eth why=.*(signed|trust|certificate)")
            said = harness.run("check", "-c", self.written(secured(made.path("ca.crt")).replace("ca.crt", "none.crt")))
            self.assertIn("none.crt; give the path of a PEM file", said.stderr)
            plain = secured(made.path("ca.crt")).replace("modbus-tcp://", "tcp://").replace("in_flight: 4, ", "")
            self.assertIn("tls belongs to a device of modbus-tcp://",
                          harness.run("check", "-c", self.written(plain)).stderr)

    def test_why_a_handshake_failed_is_told(self):
        """The text comes from a TLS session that has ended by then."""
        with tls_plant.plant() as made, Hasty() as device:
            keys = f"tls: {{ca: {made.path('ca.crt')}}}, "
            text = config.gateway(ethernet(device.port).replace("retries: 0", keys + "retries: 0"))
            with harness.configured(text) as program:
                program.log.wait_for("line down line=eth")
                why = program.get("/api/v1/lines/eth")[1]["state"]
        self.assertRegex(why, r"^down: cannot reach modbus-tcp://127.0.0.1:\d+: [ -~]+$")

    def written(self, text):
        with tempfile.NamedTemporaryFile("w", suffix=".yaml", delete=False) as file:
            file.write(text)
        self.addCleanup(os.unlink, file.name)
        return file.name

    def test_what_has_no_wire_is_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            file = f"{folder}/panelgate.yaml"
            with open(file, "w", encoding="utf-8") as out:
                out.write(config.gateway("  - {name: eth, device: 'modbus-tcp://10.0.0.7:502', serial: {baud: 9600}, "
                                         "mode: listen, stations: [{id: 1, name: a}]}\n"))
            said = harness.run("check", "-c", file).stderr
        self.assertIn("serial belongs to a serial line: 'modbus-tcp://10.0.0.7:502' has none", said)
        self.assertIn("mode listen needs a line that others can be heard on", said)


if __name__ == "__main__":
    unittest.main()
