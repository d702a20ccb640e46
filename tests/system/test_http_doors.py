"""The HTTP server's doors: who gets in, under which name, from where, and how many."""
import contextlib
import json
import pathlib
import socket
import struct
import tempfile
import threading
import time
import unittest

import harness
from config import ADMIN, gateway, line

PRESS = "/api/v1/stations/press/devices/"


class Connection:
    """Raw HTTP: what is sent is what the test says."""

    def __init__(self, port, own_address="127.0.0.1"):
        self.socket = socket.create_connection(("127.0.0.1", port), harness.PATIENCE,
                                               (own_address, 0))
        self._file = self.socket.makefile("rb")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self._file.close()
        self.socket.close()

    def ask(self, method, path, *headers, body=None, host="localhost", version="1.1"):
        """The Answer; headers are whole lines."""
        self.send(method, path, *headers, body=body, host=host, version=version)
        return self.receive()

    def send(self, method, path, *headers, body=None, host="localhost", version="1.1"):
        lines = [f"{method} {path} HTTP/{version}", *([f"Host: {host}"] if host else []), *headers]
        data = b"" if body is None else json.dumps(body).encode()
        if data:
            lines.append(f"Content-Length: {len(data)}")
        self.socket.sendall("\r\n".join([*lines, "", ""]).encode("latin-1") + data)

    def wait_for_end(self):
        self._file.read()

    def end_input(self):
        self.socket.shutdown(socket.SHUT_WR)

    def receive(self):
        """The next answer that is final; None: the connection ended before."""
        while True:
            start = self._file.readline()
            if not start:
                return None
            headers = {}
            while (text := self._file.readline().decode().rstrip("\r\n")):
                name, value = text.split(": ", 1)
                headers[name.lower()] = value
            status = int(start.split()[1])
            if status >= 200:
                return Answer(status, headers, self._file.read(int(headers.get("content-length", 0))))


class Answer:
    def __init__(self, status, headers, body):
        self.status, self.headers, self.body = status, headers, body

    def json(self):
        return json.loads(self.body)


class Doors(unittest.TestCase):
    CONFIG = gateway(line(), http=ADMIN)

    @classmethod
    def setUpClass(cls):
        cls.stack = contextlib.ExitStack()
        cls.program = cls.stack.enter_context(harness.configured(cls.CONFIG))
        cls.port = cls.program.http_port()

    @classmethod
    def tearDownClass(cls):
        cls.stack.close()

    def ask(self, *request, **options):
        with Connection(self.port) as connection:
            return connection.ask(*request, **options)

    def status(self, *request, **options):
        answer = self.ask(*request, **options)
        return answer.status if answer else None


class Places(Doors):
    def test_256_idle_connections_close_neither_probes_nor_rest(self):
        with contextlib.ExitStack() as crowd:
            for _ in range(256):
                crowd.enter_context(Connection(self.port))
            for path in ("/healthz", "/readyz", "/api/v1/stations", PRESS + "UW0", "/metrics"):
                self.assertEqual(self.status("GET", path), 200, path)

    def test_many_addresses_of_idle_connections_close_nothing_either(self):
        with contextlib.ExitStack() as crowd:
            for n in range(2, 12):
                for _ in range(32):
                    crowd.enter_context(Connection(self.port, f"127.0.0.{n}"))
            for path in ("/healthz", "/readyz", "/api/v1/stations", PRESS + "UW0"):
                self.assertEqual(self.status("GET", path), 200, path)

    def test_streams_of_events_leave_their_address_its_places(self):
        with contextlib.ExitStack() as crowd:
            for _ in range(32):
                crowd.enter_context(Connection(self.port)).ask("GET", "/healthz")
            for _ in range(48):
                stream = crowd.enter_context(Connection(self.port))
                stream.send("GET", "/api/v1/events")
                self.assertEqual(stream._file.readline(), b"HTTP/1.1 200 OK\r\n")
            self.assertEqual(self.ask("PUT", PRESS + "UW100", body={"values": [1]}).status, 200)
            refused = self.ask("GET", "/api/v1/events")
            self.assertEqual(refused.status, 503)
            self.assertEqual(refused.headers["content-type"], "application/problem+json")
            self.assertEqual(refused.headers["retry-after"], "5")
            self.assertEqual(refused.json()["status"], 503)
            for path in ("/healthz", "/readyz", "/api/v1/stations"):
                self.assertEqual(self.status("GET", path), 200, path)
            with Connection(self.port, "127.0.0.2") as other:
                other.send("GET", "/api/v1/events")
                self.assertEqual(other._file.readline(), b"HTTP/1.1 200 OK\r\n")


class HalfClosed(Doors):
    def test_P3_a_client_that_closes_its_sending_side_gets_its_answers(self):
        with Connection(self.port) as client:
            client.send("GET", PRESS + "UW0?count=5")
            client.end_input()
            self.assertEqual(client.receive().json()["values"], [10, 20, 30, 40, 50])
            self.assertIsNone(client.receive())

    def test_P3_so_do_its_writes(self):
        for value in range(20):
            with Connection(self.port) as client:
                client.send("PUT", PRESS + "UW100", body={"values": [value]})
                client.end_input()
                self.assertTrue(client.receive().json()["confirmed"])
            self.assertEqual(self.program.values(PRESS + "UW100"), [value])

    def test_P2_one_that_was_reset_takes_its_waiting_write_along(self):
        self.assertEqual(self.program.rest("PUT", PRESS + "UW100", {"values": [7]})[0], 200)
        self.program.rest("PUT", "/api/v1/simulator/press", {"dead": True})
        try:
            with Connection(self.port) as first, Connection(self.port) as leaver:
                first.send("GET", PRESS + "UW0")
                leaver.send("PUT", PRESS + "UW100", body={"values": [8]})
                leaver.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                leaver.close()
                first.receive()
        finally:
            self.program.rest("PUT", "/api/v1/simulator/press", {})
        self.assertEqual(self.program.values(PRESS + "UW100"), [7])


class Names(Doors):
    def test_a_page_under_a_foreign_name_reads_and_writes_nothing(self):
        before = self.program.values(PRESS + "UW100")
        evil = "evil.example:28080"
        answer = self.ask("PUT", PRESS + "UW100", f"Origin: http://{evil}",
                          "Content-Type: application/json", body={"values": [4242]}, host=evil)
        self.assertEqual(answer.status, 421)
        self.assertEqual(answer.headers["content-type"], "application/problem+json")
        self.assertIn("evil.example", answer.json()["detail"])
        for path in ("/", "/metrics", "/api/v1/stations", "/nothing"):
            self.assertEqual(self.status("GET", path, host=evil), 421, path)
        self.assertEqual(self.program.values(PRESS + "UW100"), before)

    def test_its_own_names_are_known_in_all_their_forms(self):
        for host in ("localhost", "LOCALHOST:1", "127.0.0.1", f"127.0.0.1:{self.port}", "localhost.",
                     socket.gethostname(), "[::1]:80"):
            self.assertEqual(self.status("GET", "/api/v1/lines", host=host), 200, host)

    def test_P2_what_follows_a_body_of_unclear_length_is_no_request(self):
        before = self.program.values(PRESS + "UW100")
        hidden = (f"PUT {PRESS}UW100 HTTP/1.1\r\nHost: localhost\r\nContent-Length: 17\r\n\r\n"
                  '{"values":[4242]}').encode()
        for coding in ("xchunked", "identity", "gzip", "chunked, identity", "gzip, chunked", ""):
            with self.subTest(coding=coding), Connection(self.port) as connection:
                connection.socket.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n"
                                          b"Transfer-Encoding: " + coding.encode() + b"\r\n\r\n"
                                          + hidden)
                self.assertEqual(connection.receive().status, 400)
                self.assertIsNone(connection.receive(), "the connection ends")
        self.assertEqual(self.program.values(PRESS + "UW100"), before)

    def test_a_trailer_names_no_host_and_a_header_comes_once(self):
        body = b'{"values":[4242]}'
        with Connection(self.port) as connection:
            connection.socket.sendall(
                f"PUT {PRESS}UW100 HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n".encode()
                + b"%x\r\n%b\r\n0\r\nHost: localhost\r\n\r\n" % (len(body), body))
            self.assertEqual(connection.receive().status, 400)
        self.assertEqual(self.status("GET", "/", "Authorization: Bearer a", "Authorization: Bearer b"),
                         400)

    def test_probes_are_asked_by_any_name(self):
        for path in ("/healthz", "/readyz"):
            self.assertEqual(self.status("GET", path, host="pod-17.cluster"), 200)

    def test_a_request_has_one_host(self):
        self.assertEqual(self.status("GET", "/", host=None), 400)
        self.assertEqual(self.status("GET", "/", "Host: localhost"), 400)
        self.assertEqual(self.status("GET", "/", host=None, version="1.0"), 200)

    def test_absolute_targets_and_options(self):
        self.assertEqual(self.status("GET", "http://localhost/api/v1/lines"), 200)
        self.assertEqual(self.status("GET", "http://evil.example/api/v1/lines"), 421)
        answer = self.ask("OPTIONS", PRESS + "UW100")
        self.assertEqual((answer.status, answer.headers["allow"]), (204, "GET, HEAD, PUT, OPTIONS"))
        self.assertEqual(self.status("OPTIONS", "*"), 204)

    def test_pages_of_other_sites_ask_nothing(self):
        for site, status in (("cross-site", 403), ("same-origin", 200), ("none", 200)):
            self.assertEqual(self.status("GET", PRESS + "UW0", f"Sec-Fetch-Site: {site}",
                                         "Sec-Fetch-Mode: no-cors", "Sec-Fetch-Dest: image"), status)
        self.assertEqual(self.status("GET", "/", "Sec-Fetch-Site: cross-site",
                                     "Sec-Fetch-Mode: navigate", "Sec-Fetch-Dest: document"), 200)

    def test_media_types_are_compared_without_case(self):
        for kind, status in (("Application/JSON", 200), ("text/plain", 415)):
            self.assertEqual(self.status("PUT", PRESS + "UW100", f"Content-Type: {kind}",
                                         "Origin: http://localhost", body={"values": [1]}), status)

    def test_bytes_that_are_no_utf8_are_refused_and_not_said_again(self):
        for path in ("/api/v1/stations/%ff", "/api/v1/stations/%C3%28", "/api/v1/stations/\xff",
                     PRESS + "UW0?type=%80"):
            answer = self.ask("GET", path)
            self.assertEqual(answer.status, 400, path)
            answer.json()


class GivenNames(Doors):
    CONFIG = gateway(line(), http=ADMIN + ", hosts: [Gateway.plant.example, 192.0.2.7]")

    def test_hosts_take_the_place_of_the_machines_names(self):
        for host, status in (("gateway.plant.example:8080", 200), ("192.0.2.7", 200),
                             ("localhost", 200), ("127.0.0.1", 200), ("192.0.2.8", 200),
                             (socket.gethostname(), 421)):
            self.assertEqual(self.status("GET", "/api/v1/lines", host=host), status, host)


class OtherSites(Doors):
    """Pages of other sites that may read (the CORS protocol of the Fetch standard)."""
    SITE = "https://scada.plant.example"
    CONFIG = gateway(line(), http=ADMIN + ', cors: ["https://SCADA.plant.example:443", "http://[fd00::1]:8080"]')

    def shared(self, answer):
        return answer.headers.get("access-control-allow-origin")

    def test_a_listed_site_may_read_and_is_told_so_before(self):
        for site in (self.SITE, "http://[fd00::1]:8080"):
            answer = self.ask("GET", PRESS + "UW0", f"Origin: {site}", "Sec-Fetch-Site: cross-site",
                              "Sec-Fetch-Mode: cors", "Sec-Fetch-Dest: empty")
            self.assertEqual((answer.status, self.shared(answer)), (200, site))
            self.assertIn("Origin", answer.headers["vary"])
        before = self.ask("OPTIONS", PRESS + "UW0", f"Origin: {self.SITE}",
                          "Access-Control-Request-Method: GET",
                          "Access-Control-Request-Headers: authorization")
        self.assertEqual((before.status, self.shared(before)), (204, self.SITE))
        self.assertEqual(before.headers["access-control-allow-methods"], "GET, HEAD")
        self.assertIn("Authorization", before.headers["access-control-allow-headers"])

    def test_its_page_sees_what_is_refused_and_events(self):
        wrong = self.ask("GET", "/api/v1/lines", f"Origin: {self.SITE}", "Authorization: Bearer no")
        self.assertEqual((wrong.status, self.shared(wrong)), (401, self.SITE))
        with Connection(self.port) as stream:
            stream.send("GET", "/api/v1/events?types=station", f"Origin: {self.SITE}")
            self.assertEqual(self.shared(stream.receive()), self.SITE)

    def test_it_writes_nothing_and_others_do_not_even_read(self):
        write = self.ask("PUT", PRESS + "UW100", f"Origin: {self.SITE}",
                         "Content-Type: application/json", body={"values": [1]})
        self.assertEqual(write.status, 403)
        self.assertIn("may only read", write.json()["detail"])
        for site in ("http://scada.plant.example", "https://scada.plant.example:8443", "null",
                     "https://scada.plant.example.evil", "https://evil.example", "*"):
            for method in ("GET", "OPTIONS"):
                answer = self.ask(method, PRESS + "UW0", f"Origin: {site}")
                self.assertIsNone(self.shared(answer), site)
            self.assertEqual(self.status("GET", PRESS + "UW0", f"Origin: {site}"), 403, site)

    def test_its_stream_ends_where_a_reload_takes_it_out(self):
        with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
            file = pathlib.Path(folder) / "panelgate.yaml"
            file.write_text(self.CONFIG)
            program = stack.enter_context(harness.Program("run", "-c", str(file)))
            stream = stack.enter_context(Connection(program.http_port()))
            stream.send("GET", "/api/v1/events?types=transaction", f"Origin: {self.SITE}")
            self.assertEqual(stream.receive().status, 200)
            file.write_text(self.CONFIG.replace('"https://SCADA.plant.example:443", ', ""))
            self.assertEqual(program.rest("POST", "/api/v1/reload", {})[0], 200)
            stream.wait_for_end()

    def test_without_an_origin_nothing_is_added(self):
        self.assertIsNone(self.shared(self.ask("GET", "/api/v1/lines")))
        self.assertEqual(self.status("GET", PRESS + "UW0", "Sec-Fetch-Site: cross-site",
                                     "Sec-Fetch-Mode: no-cors", "Sec-Fetch-Dest: image"), 403)


class Allowed(unittest.TestCase):
    def test_who_is_not_in_the_list_is_closed_without_a_byte(self):
        with harness.configured(gateway(line(), http=ADMIN + ", allow: [127.0.0.2/31]")) as program:
            port = program.http_port()
            with Connection(port, "127.0.0.3") as friend, Connection(port) as stranger:
                self.assertEqual(friend.ask("GET", "/healthz").status, 200)
                with contextlib.suppress(ConnectionError):
                    stranger.send("GET", "/healthz")
                    self.assertIsNone(stranger.receive())
            program.log.wait_for(r"info connection refused .*client=127\.0\.0\.1 .*allow list")


class Logins(unittest.TestCase):
    def setUp(self):
        file = self.enterContext(tempfile.NamedTemporaryFile("w"))
        file.write("right-and-long-enough")
        file.flush()
        tokens = f"[{{name: ops, role: operator, file: {file.name}}}]"
        self.program = self.enterContext(harness.configured(
            gateway(line(), http=f"{ADMIN}, tokens: {tokens}")))
        self.port = self.program.http_port()

    def status(self, token, address="127.0.0.1"):
        with Connection(self.port, address) as client:
            return client.ask("GET", "/api/v1/lines", f"Authorization: Bearer {token}").status

    def metric(self, name):
        for text in self.program.get("/metrics")[1].splitlines():
            if text.startswith(name + " "):
                return float(text.split()[-1])
        return None

    def test_wrong_tokens_are_counted_and_logged_and_end_in_429_by_address(self):
        self.assertEqual([self.status("wrong") for _ in range(12)], [401] * 10 + [429] * 2)
        right = [self.status("right-and-long-enough", address) for address in ("127.0.0.1", "127.0.0.2")]
        self.assertEqual(right, [429, 200])
        with Connection(self.port) as client:
            answer = client.ask("GET", "/api/v1/lines", "Authorization: Bearer right-and-long-enough")
            self.assertIn(int(answer.headers["retry-after"]), range(1, 61))
        self.assertEqual(self.metric("panelgate_login_failures_total"), 11)
        self.assertEqual(self.metric('panelgate_http_requests_total{code="401"}'), 10)
        self.assertEqual(self.metric('panelgate_http_requests_total{code="429"}'), 4)
        self.program.log.wait_for(r"warn(ing)? login failed .*client=127\.0\.0\.1")
        self.assertNotIn("wrong", self.program.log.text())


if __name__ == "__main__":
    unittest.main()
