"""Server-sent events: what happens is told to those who listen."""
import http.client
import json
import struct
import unittest

import harness
from harness import read_registers
from test_points import POINT, PRESS, SELDOM, quality, until


class Events:
    """A listener; a context manager."""

    def __init__(self, program, query=""):
        self._connection = http.client.HTTPConnection("127.0.0.1", program.http_port(),
                                                      timeout=harness.PATIENCE)
        self._connection.request("GET", "/api/v1/events" + query)
        self.response = self._connection.getresponse()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._connection.close()

    def next(self, wanted, **members):
        """The next event of this type with these members."""
        kind = None
        for line in iter(self.response.readline, b""):
            text = line.decode().rstrip("\n")
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

    def test_only_what_was_asked_for(self):
        with harness.configured(PRESS) as program:
            with Events(program, "?types=station") as events:
                program.rest("PUT", "/api/v1/simulator/press", {"dead": True})
                first = events.response.readline(), events.response.readline()
                self.assertEqual(first, (b": panelgate\n", b"\n"))
                self.assertTrue(events.response.readline().startswith(b"id: "))
                self.assertEqual(events.response.readline(), b"event: station\n")
            self.assertEqual(program.get("/api/v1/events?types=weather")[0], 400)

    def test_the_end_of_the_program_ends_the_events(self):
        with harness.configured(PRESS) as program:
            with Events(program) as events:
                until(lambda: events.response.readline())
                self.assertEqual(program.stop(), 0)
                self.assertIsInstance(events.response.read(), bytes)


if __name__ == "__main__":
    unittest.main()
