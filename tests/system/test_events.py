"""Server-sent events: what happens is told to those who listen."""
import contextlib
import http.client
import json
import pathlib
import socket
import struct
import tempfile
import threading
import unittest

import config
import harness
from browser import Browser
from harness import read_registers, write_register
from rtu_bus import RtuBus, echo_address
from test_points import POINT, PRESS, SELDOM, quality, until


TWO = config.gateway(
    config.line(stations="""{id: 31, name: press, profile: autonics-gplp-s, points: [
      {name: mode, at: UW105, writable: true, every: 20ms}]}"""),
    config.line("floor2", stations="{id: 20, name: oven, profile: panasonic-gt}"),
    http=config.ADMIN, modbus=config.FREE_PORT)
# Cached answers are the quickest events.
FLOOD = config.gateway(config.line(stations="""{id: 31, name: press, profile: autonics-gplp-s,
      max_age: 60s, poll: [{read: UW0, count: 8, every: 10s}]}"""), http=config.ADMIN)


class Cutter:
    """Stands between a client and the program: passes connections on, or closes them. A context
    manager."""

    def __init__(self, port):
        self._port = port
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self._sockets = []
        self._threads = []
        self._lock = threading.Lock()
        self.is_cut = False
        self._start(self._accept)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.cut()
        self._listener.shutdown(socket.SHUT_RDWR)
        for thread in self._threads:
            thread.join(harness.PATIENCE)
        for one in [self._listener, *self._sockets]:
            one.close()

    def cut(self):
        with self._lock:
            self.is_cut = True
            for one in self._sockets:
                with contextlib.suppress(OSError):
                    one.shutdown(socket.SHUT_RDWR)

    def mend(self):
        self.is_cut = False

    def _start(self, work, *arguments):
        self._threads.append(threading.Thread(target=work, args=arguments, daemon=True))
        self._threads[-1].start()

    def _accept(self):
        with contextlib.suppress(OSError):
            while True:
                near, _ = self._listener.accept()
                with self._lock:
                    if self.is_cut:
                        near.close()
                        continue
                    far = socket.create_connection(("127.0.0.1", self._port))
                    self._sockets += [near, far]
                for pair in ((near, far), (far, near)):
                    self._start(self._pass_on, *pair)

    @staticmethod
    def _pass_on(source, sink):
        with contextlib.suppress(OSError):
            while data := source.recv(65536):
                sink.sendall(data)
        for one in (source, sink):
            with contextlib.suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)


class Events:
    """A listener; a context manager. With the id of the last event that another one has got it goes
    on from there."""

    def __init__(self, program, query="", last_id=None, receive_buffer=None):
        self._connection = http.client.HTTPConnection("127.0.0.1", program.http_port(),
                                                      timeout=harness.PATIENCE)
        if receive_buffer:
            self._connection.sock = socket.socket()
            self._connection.sock.settimeout(harness.PATIENCE)
            self._connection.sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
            self._connection.sock.connect(("127.0.0.1", program.http_port()))
        headers = {"Last-Event-ID": last_id} if last_id else {}
        self._connection.request("GET", "/api/v1/events" + query, headers=headers)
        self.response = self._connection.getresponse()
        self.last_id = last_id

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._connection.close()

    def next(self, wanted, **members):
        """The next event of this type with these members."""
        kind = None
        for line in iter(self.response.readline, b""):
            text = line.decode().rstrip("\n")
            if text.startswith("id: "):
                self.last_id = text[4:]
            if text.startswith("event: "):
                kind = text[7:]
            if text.startswith("data: ") and kind == wanted:
                data = json.loads(text[6:])
                if all(data.get(key) == value for key, value in members.items()):
                    return data
        raise AssertionError(f"the events ended before {wanted} {members}")


class ServerSentEvents(unittest.TestCase):
    def test_points_stations_and_transactions(self):
        with harness.configured(PRESS) as program, Events(program) as events, \
                program.client() as client:
            self.assertEqual(events.response.getheader("Content-Type"), "text/event-stream")
            self.assertEqual(program.rest("PUT", POINT + "level", {"value": 17.5})[0], 200)
            level = events.next("point", name="level", value=17.5)
            self.assertEqual((level["line"], level["station"], level["quality"]),
                             ("floor1", "press", "good"))
            client.ask(31, read_registers(300))
            self.assertEqual(events.next("transaction", function=3, outcome="ok")["station"], "press")
            program.rest("PUT", "/api/v1/simulator/press", {"dead": True})
            events.next("station", station="press", event="offline")
            self.assertEqual(events.next("point", name="level")["quality"], "stale")
            program.rest("PUT", "/api/v1/simulator/press", {})
            events.next("station", station="press", event="online")

    def test_P10_a_point_that_is_written_is_told_as_stale_and_then_as_it_is(self):
        with harness.configured(SELDOM) as program, program.client() as client:
            until(lambda: quality(program, "level") == "good")
            with Events(program, "?types=point") as events:
                self.assertEqual(client.ask(31, struct.pack(">BHHBH", 16, 100, 1, 2, 333))[0], 16)
                self.assertEqual(events.next("point", name="level")["quality"], "stale")
                level = events.next("point", name="level")
                self.assertEqual((level["value"], level["quality"]), (333, "good"))

    def test_P10_a_line_that_is_pulled_takes_what_is_known_of_its_stations_along(self):
        with tempfile.TemporaryDirectory() as folder:
            link = pathlib.Path(folder) / "tty"
            text = config.gateway(config.line("shaky", link, "{id: 1, name: one}", baud=115200))
            with harness.configured(text) as program, program.client() as client, \
                    Events(program, "?types=station,line") as events:
                for times in (1, 2):
                    with RtuBus(link, {1: echo_address}):
                        program.log.wait_for("line up", times)
                        self.assertEqual(client.ask(1, read_registers(5))[0], 3)
                        events.next("station", station="one", event="online")
                        self.assertEqual(program.get("/api/v1/stations/one")[1]["state"], "online")
                    events.next("line", state="down")
                    events.next("station", station="one", event="unknown")
                    self.assertEqual(program.get("/api/v1/stations/one")[1]["state"], "unknown")

    def test_only_what_was_asked_for(self):
        with harness.configured(PRESS) as program:
            with Events(program, "?types=station") as events:
                program.rest("PUT", "/api/v1/simulator/press", {"dead": True})
                first = events.response.readline(), events.response.readline()
                self.assertEqual(first, (b": panelgate\n", b"\n"))
                self.assertEqual(events.response.readline(), b"retry: 2000\n")
                self.assertTrue(events.response.readline().startswith(b"id: "))
                self.assertEqual(events.response.readline(), b"\n")
                self.assertTrue(events.response.readline().startswith(b"id: "))
                self.assertEqual(events.response.readline(), b"event: station\n")
            self.assertEqual(program.get("/api/v1/events?types=weather")[0], 400)
            self.assertEqual(program.get("/api/v1/events?line=attic")[0], 404)

    def test_only_of_what_was_asked_for(self):
        with harness.configured(TWO) as program, program.client() as client:
            with Events(program, "?types=transaction&station=oven") as oven, \
                    Events(program, "?line=floor1") as line, Events(program, "?point=press/mode") as mode:
                for address in range(5):
                    client.ask(31, read_registers(address))
                client.ask(20, read_registers(0))
                first = oven.next("transaction")
                self.assertEqual((first["line"], first["station"]), ("floor2", "oven"))
                self.assertEqual(line.next("transaction")["station"], "press")
                program.rest("PUT", POINT + "mode", {"value": 1})
                self.assertEqual(mode.next("point", value=1)["name"], "mode")

    def test_who_comes_back_is_given_what_it_has_missed(self):
        with harness.configured(TWO) as program, program.client() as client:
            with Events(program, "?types=transaction&station=oven") as events:
                client.ask(20, read_registers(0))
                events.next("transaction")
                last = events.last_id
            for _ in range(3):
                client.ask(20, write_register(7, 1))
            with Events(program, "?types=transaction&station=oven", last) as events:
                ids = []
                for _ in range(3):
                    self.assertEqual(events.next("transaction")["function"], 6)
                    ids.append(events.last_id)
                self.assertEqual(len({*ids, last}), 4)

    def test_an_id_of_before_a_restart_is_not_mistaken(self):
        with harness.configured(TWO) as program, program.client() as client:
            with Events(program, "?types=transaction") as events:
                client.ask(20, read_registers(0))
                events.next("transaction")
                last = events.last_id
        with harness.configured(TWO) as program, program.client() as client:
            with Events(program, "?types=transaction", last) as events:
                self.assertEqual(events.next("lost"), {"events": None, "exact": False})
                client.ask(20, read_registers(1))
                self.assertEqual(events.next("transaction")["function"], 3)
                self.assertNotEqual(events.last_id.split("-")[0], last.split("-")[0])

    def test_the_slow_are_told_how_much_they_have_lost(self):
        with harness.configured(FLOOD) as program, \
                Events(program, "?types=transaction", receive_buffer=4096) as slow, \
                Events(program, "?types=transaction") as quick:
            count = 0
            with program.client() as client:
                while count < 12000:  # more than the sockets and what is kept can hold together
                    for _ in range(16):
                        client.send(31, read_registers(0))
                    for _ in range(16):
                        client.receive()
                        quick.next("transaction")
                    count += 16
            told = slow.next("lost")
            self.assertTrue(told["exact"])
            self.assertGreater(told["events"], 0)
            slow.next("transaction", outcome="cached")

    def test_the_end_of_the_program_ends_the_events(self):
        with harness.configured(PRESS) as program:
            with Events(program) as events:
                until(lambda: events.response.readline())
                self.assertEqual(program.stop(), 0)
                self.assertIsInstance(events.response.read(), bytes)


class AnEventSourceOfSomebodyElse(Browser):
    """Chromium's own, which comes again by itself."""

    @classmethod
    def gateway(cls):
        return cls.enterClassContext(harness.configured(TWO))

    def test_misses_nothing_while_its_connection_is_cut(self):
        with Cutter(self.program.http_port()) as cutter, self.program.client() as client:
            self.driver.get(f"http://127.0.0.1:{cutter.port}/healthz")
            self.script("""
                window.seen = []; window.lost = 0; window.opened = 0;
                const source = new EventSource('/api/v1/events?types=transaction&station=oven');
                source.onopen = () => { window.opened += 1; };
                source.addEventListener('lost', () => { window.lost += 1; });
                source.addEventListener('transaction', (event) => { window.seen.push(event.lastEventId); });""")
            self.wait(lambda: self.script("return opened") == 1)
            def write(count):
                for _ in range(count):
                    client.ask(20, write_register(7, 1))
            write(3)
            self.wait(lambda: len(self.script("return seen")) == 3)
            cutter.cut()
            write(4)
            cutter.mend()
            self.wait(lambda: self.script("return opened") == 2)
            write(3)
            self.wait(lambda: len(self.script("return seen")) >= 10)
            seen = self.script("return seen")
            self.assertEqual((len(seen), len(set(seen)), self.script("return lost")), (10, 10, 0))


if __name__ == "__main__":
    unittest.main()
