"""Places at a listener with TLS: whoever has not shown a certificate takes nobody's."""
import contextlib
import http.client
import socket
import unittest

import harness
from harness import read_registers
from tls_plant import SecureClient, plant, served, status_of

READ = read_registers(0)


class Silent(unittest.TestCase):
    """Connections that open and never say hello, at a listener whose places are all taken."""

    @classmethod
    def setUpClass(cls):
        context = plant()
        cls.made = context.__enter__()  # pylint: disable=unnecessary-dunder-call
        cls.addClassCleanup(context.__exit__, None, None, None)

    def clients(self, stack, port, count):
        made = [stack.enter_context(SecureClient(port, self.made.context("scada")))
                for _ in range(count)]
        for client in made:
            self.assertEqual(client.ask(31, READ)[0], 3)
        return made

    def silent(self, stack, port, count, address="127.0.0.9"):
        return [stack.enter_context(socket.create_connection(
            ("127.0.0.1", port), harness.PATIENCE, source_address=(address, 0)))
            for _ in range(count)]

    def test_a_full_listener(self):
        with served(self.made, self.made.tls("required") + ", max_connections: 4") as program, \
                contextlib.ExitStack() as stack:
            port = program.modbus_port()
            clients = self.clients(stack, port, 4)
            silent = self.silent(stack, port, 20)
            for raw in silent[:4]:  # max_handshakes_per_address: 16
                self.assertEqual(raw.recv(1), b"", "it gave way to the next")
            for client in clients:
                self.assertEqual(client.ask(31, READ)[0], 3)
            self.assertNotIn("connection gives way", program.log.text())
            newcomer = stack.enter_context(SecureClient(port, self.made.context("scada")))
            self.assertEqual(newcomer.ask(31, READ)[0], 3, "who shows a certificate finds a place")
            program.log.wait_for("connection gives way .*longest idle")

    def test_an_address_that_has_its_share(self):
        tls = self.made.tls("required")
        with served(self.made, tls + ", max_connections_per_address: 4") as program, \
                contextlib.ExitStack() as stack:
            port = program.modbus_port()
            clients = self.clients(stack, port, 4)
            for raw in self.silent(stack, port, 20, "127.0.0.1")[:4]:
                self.assertEqual(raw.recv(1), b"", "it gave way to the next")
            for client in clients:
                self.assertEqual(client.ask(31, READ)[0], 3)

    def test_https(self):
        with served(self.made, http=self.made.tls("required")) as program, \
                contextlib.ExitStack() as stack:
            port = program.http_port()
            made = [http.client.HTTPSConnection("localhost", port, timeout=harness.PATIENCE,
                                                context=self.made.context("scada"))
                    for _ in range(32)]  # max_connections_per_address
            for one in made:
                stack.callback(one.close)
                self.assertEqual(status_of(one, "/api/v1/lines"), 200)
            for raw in self.silent(stack, port, 20, "127.0.0.1")[:4]:
                self.assertEqual(raw.recv(1), b"", "it gave way to the next")
            for one in made:
                one.auto_open = False  # not by another connection
                self.assertEqual(status_of(one, "/api/v1/lines"), 200)


if __name__ == "__main__":
    unittest.main()
