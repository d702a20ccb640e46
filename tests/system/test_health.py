"""panelgate health: 0 when the gateway is ready, else 1 and what came instead."""
import contextlib
import pathlib
import socket
import tempfile
import threading
import unittest

import config
import harness


@contextlib.contextmanager
def server(answer):
    """A port on which each connection is sent these bytes; None: nothing, and it stays open."""
    listener = socket.create_server(("127.0.0.1", 0))
    held = []

    def serve():
        while True:
            try:
                client, _ = listener.accept()
            except OSError:
                return
            held.append(client)
            if answer is None:
                continue
            while b"\r\n\r\n" not in client.recv(4096):
                pass
            client.sendall(answer)
            client.shutdown(socket.SHUT_WR)

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    try:
        yield listener.getsockname()[1]
    finally:
        listener.shutdown(socket.SHUT_RDWR)
        listener.close()
        thread.join(harness.PATIENCE)
        for client in held:
            client.close()


class Health(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.file = pathlib.Path(folder.name) / "gateway.yaml"

    def ask(self, *arguments, code=0):
        ended = harness.run("health", *arguments)
        self.assertEqual(ended.returncode, code, ended.stdout + ended.stderr)
        self.assertEqual(ended.stdout, "")
        self.assertRegex(ended.stderr, r"^$" if code == 0 else r"^panelgate: [^\n]+\n$")
        return ended.stderr

    def not_ready(self, answer):
        with server(answer) as port:
            told = self.ask("--http", f"127.0.0.1:{port}", code=1)
        return told.removeprefix(f"panelgate: not ready: http://127.0.0.1:{port}/readyz: ")

    def configure(self, listen):
        self.file.write_text(config.gateway(config.line(), modbus=None,
                                            http=f'listen: "{listen}"'))

    def test_a_gateway_is_ready_and_then_it_is_gone(self):
        with harness.demo() as program:
            port = program.http_port()
            self.ask("--http", f"127.0.0.1:{port}")
            self.ask("--http", f"0.0.0.0:{port}")
        self.assertIn("Connection refused", self.ask("--http", f"127.0.0.1:{port}", code=1))

    def test_it_asks_where_the_configuration_listens(self):
        for address in ("127.0.0.1", "0.0.0.0", "[::1]", "[::]"):
            with self.subTest(address=address):
                text = config.gateway(config.line(), modbus=None, http=f'listen: "{address}:0"')
                with harness.configured(text) as program:
                    self.configure(f"{address}:{program.http_port()}")
                    self.ask("-c", str(self.file))
                told = self.ask("-c", str(self.file), code=1)
                self.assertIn("//127.0.0.1:" if "." in address else "//[::1]:", told)

    def test_nothing_but_the_rights_of_anybody_are_needed(self):
        text = config.gateway(config.line(), modbus=None,
                              http=config.FREE_PORT + ", anonymous: none")
        with harness.configured(text) as program:
            self.ask("--http", f"127.0.0.1:{program.http_port()}")

    def test_who_lets_nobody_in_from_here_is_not_ready(self):
        text = config.gateway(config.line(), modbus=None,
                              http=config.FREE_PORT + ", allow: [192.0.2.0/24]")
        with harness.configured(text) as program:
            self.assertIn("`allow`", self.ask("--http", f"127.0.0.1:{program.http_port()}", code=1))

    def test_a_configuration_that_tells_no_port_is_told(self):
        self.configure("127.0.0.1:0")
        self.assertIn("--http HOST:PORT", self.ask("-c", str(self.file), code=1))
        self.file.write_text(config.gateway(config.line(), http=None))
        self.assertIn("has no http", self.ask("-c", str(self.file), code=1))

    def test_nobody_is_asked_by_a_guess(self):
        faulty = config.gateway(config.line(), http="{listen: nowhere}")
        for text in (None, "", "lines: [\n", faulty, config.gateway(config.line(), http=None) + "x: 1\n"):
            if text is not None:
                self.file.write_text(text)
            told = self.ask("-c", str(self.file), code=1)
            self.assertIn(str(self.file), told)
            self.assertIn("--http HOST:PORT", told)

    def test_a_file_with_faults_says_where_its_gateway_listens_all_the_same(self):
        with harness.configured(config.gateway(config.line(), modbus=None)) as program:
            port = program.http_port()
            for faulty in ("lines: [\nhttp:\n  listen: 127.0.0.1:{}\n",
                           "http: {{listen: '127.0.0.1:{}', anonymous: everybody}}\nlines: []\n",
                           "nonsense: 1\nhttp: {{listen: 127.0.0.1:{}}}\n"):
                self.file.write_text(faulty.format(port))
                self.ask("-c", str(self.file))

    def test_what_comes_instead_is_told(self):
        told = self.not_ready(b"HTTP/1.1 503 Service Unavailable\r\nA: b\r\n\r\nnot ready: http\r\n")
        self.assertEqual(told, "503 Service Unavailable: not ready: http\n")
        self.assertEqual(self.not_ready(b"HTTP/1.1 404 Not Found\r\n\r\n"), "404 Not Found\n")
        self.assertEqual(self.not_ready(b"SSH-2.0-x\x1b[2J\xff\r\n"),
                         "an answer that is no HTTP: SSH-2.0-x?[2J\ufffd\n")
        self.assertIn("closed without an answer", self.not_ready(b""))
        self.assertEqual(self.not_ready(b"HTTP/1.1 2000 OK\r\n\r\n"), "2000 OK\n")
        self.assertIn("x" * 150, self.not_ready(b"x" * 100_000))
        self.assertLess(len(self.not_ready(b"x" * 100_000)), 300)

    def test_who_says_nothing_is_not_waited_for(self):
        self.assertEqual(self.not_ready(None), "no answer in time\n")

    def test_an_answer_in_pieces_is_an_answer(self):
        with server(b"HTTP/1.0 200 OK\r\n" + b"x: y\r\n" * 50 + b"\r\nready\n") as port:
            self.ask("--http", f"127.0.0.1:{port}")


if __name__ == "__main__":
    unittest.main()
