"""What REST says and refuses, on the real program: who refused, who asks, when, and numbers."""
import datetime
import re
import struct
import unittest
import urllib.error
import urllib.request

import config
import harness

GUARDED = config.line(stations="""
      {id: 31, name: press, profile: autonics-gplp-s, guard: true,
       points: [{name: tenth, at: UW100, type: f32, writable: true, every: 20ms},
                {name: level, at: UW104, type: i16, scale: 0.1, writable: true, every: 20ms}]},
      {id: 5, name: meter, profile: autonics-gplp-s, access: read_only}""")
FREE_LINE = config.line("floor2", stations="{id: 9, name: oven, profile: panasonic-gt}")
FORBIDDEN = config.line("floor3", device="/dev/null", stations="{id: 7, name: scale}")
PLANT = config.gateway(GUARDED, FREE_LINE, FORBIDDEN, http=config.ADMIN,
                       modbus=config.FREE_PORT + ", lines: [floor1]")
PRESS = "/api/v1/stations/press/"
FLOOR = "/api/v1/lines/floor1/"


def text_of(program, path):
    with urllib.request.urlopen(program.url(path), timeout=harness.PATIENCE) as response:
        return response.read().decode()


def polled(program, point, as_wanted=lambda value: True):
    """Waits until a poll has brought a good value like this; each look is a request to the program,
    for the list: a single point is read behind a write."""
    for _ in range(5000):
        points = program.get(PRESS + "points")[1]["points"]
        shown = next(one for one in points if one["name"] == point)
        value = shown["value"]
        if shown["quality"] == "good" and as_wanted(value):
            return
    raise AssertionError(f"{point} is never as it should be, but {value}")


class Rest(unittest.TestCase):
    def test_what_is_refused_here_says_so_and_by_which_rule(self):
        with harness.configured(PLANT) as program:
            for method, path, body, status, rule in (
                    ("GET", PRESS + "holding-registers/65520", None, 422, "range"),
                    ("GET", PRESS + "discrete-inputs/0", None, 422, "function"),
                    ("PUT", PRESS + "holding-registers/65520", {"values": [1, 2]}, 422, "range"),
                    ("POST", FLOOR + "raw", {"station": 31, "pdu": "03FFF00001"}, 422, "range"),
                    ("POST", FLOOR + "raw", {"station": 31, "pdu": "170000000100000001020000"},
                     422, "function"),
                    ("PUT", "/api/v1/stations/meter/devices/UW0", {"values": [1]}, 403, "access"),
                    ("POST", FLOOR + "raw", {"station": 5, "pdu": "0600000001"}, 403, "access"),
                    ("POST", FLOOR + "raw", {"station": 0, "pdu": "0600000001"}, 403, "access"),
                    ("POST", FLOOR + "broadcast",
                     {"table": "holding-registers", "address": 0, "values": [1]}, 403, "access")):
                with self.subTest(path=path, body=body):
                    got, told = program.rest(method, path, body)
                    self.assertEqual((got, told["transmitted"]), (status, False), told)
                    self.assertEqual(told["type"], "urn:panelgate:problem:refused")
                    self.assertEqual(told["rule"], rule)
                    self.assertIn("refused here", told["detail"])
                    self.assertNotIn("the panel answered", told["detail"])
            sent = b"".join(frame for way, frame in program.trace("floor1") if way == "sent")
            self.assertNotIn(b"\xff\xf0", sent)

    def test_P2_raw_to_station_0_is_a_broadcast_without_a_reply(self):
        with harness.configured(PLANT) as program:
            self.assertEqual(
                program.rest("POST", "/api/v1/lines/floor2/raw",
                             {"station": 0, "pdu": "06000A0001"}),
                (202, {"transmitted": True, "confirmed": False}))

    def test_P2_a_write_with_a_key_goes_out_once(self):
        with harness.configured(PLANT) as program:
            def write(value):
                request = urllib.request.Request(
                    program.url(PRESS + "devices/UW200"), method="PUT",
                    data=b'{"values":[%d]}' % value, headers={"Idempotency-Key": "same"})
                with urllib.request.urlopen(request, timeout=harness.PATIENCE) as answer:
                    return answer.status, answer.headers.get("Idempotency-Replayed"), answer.read()
            first = write(7)
            self.assertEqual(first, (200, None, b'{"transmitted":true,"confirmed":true}\n'))
            self.assertEqual(write(7), (200, "true", first[2]))
            with self.assertRaises(urllib.error.HTTPError) as refused:
                write(8)
            self.assertEqual(refused.exception.code, 422)
            refused.exception.close()
            sent = [f for way, f in program.trace("floor1", 500) if way == "sent"]
            self.assertEqual([f for f in sent if f[1] == 16],
                             [harness.rtu(31, bytes.fromhex("1000C80001020007"))])

    def test_P3_a_long_read_ends_within_the_deadline_of_its_line(self):
        text = config.gateway(config.line(queue="{deadline: 300ms}"), http=config.ADMIN)
        with harness.configured(text) as program:
            status, told = program.get(PRESS + "holding-registers/0?count=6000")
            self.assertIn(status, (503, 504))  # it may be on the wire when its time is over
            self.assertRegex(told["detail"], r"^the time of this request was over after \d+ of 6000")

    def test_a_line_that_is_down_says_over_rest_what_its_state_says(self):
        with harness.configured(PLANT) as program:
            status, told = program.get("/api/v1/stations/scale/holding-registers/0")
            state = program.get("/api/v1/lines/floor3")[1]["state"]
            self.assertTrue(state.startswith("down: "), state)
            self.assertEqual((status, told["transmitted"]), (502, False))
            self.assertIn(state.removeprefix("down: "), told["detail"])

    def test_P2_mistakes_are_not_executed(self):
        with harness.configured(PLANT) as program:
            for body in ('{"values":[1],"values":[2]}', '{"values":[1],"valeus":[3]}',
                         '{"values":[1],"Values":[2]}'):
                request = urllib.request.Request(program.url(PRESS + "devices/UW0"),
                                                 data=body.encode(), method="PUT")
                with self.subTest(body=body), self.assertRaises(urllib.error.HTTPError) as refused:
                    urllib.request.urlopen(request, timeout=harness.PATIENCE)
                self.assertEqual(refused.exception.code, 400)
                refused.exception.close()
            for path in ("devices/UW0?cuont=9", "devices/UW0?count=1&count=2"):
                self.assertEqual(program.get(PRESS + path)[0], 400, path)
            self.assertEqual(program.rest("PUT", PRESS + "devices/UW0?count=7", {"values": [1]})[0],
                             400)
            self.assertEqual(program.values(PRESS + "devices/UW0"), [10])

    def test_numbers_are_written_as_people_write_them(self):
        with harness.configured(PLANT) as program:
            self.assertEqual(program.rest("PUT", PRESS + "points/tenth", {"value": 0.1})[0], 200)
            self.assertEqual(program.rest("PUT", PRESS + "points/level", {"value": 29.5})[0], 200)
            for point, shown in (("tenth", "0.1"), ("level", "29.5")):
                path = PRESS + "points/" + point
                polled(program, point, lambda value: abs(value - float(shown)) < 1e-6)
                self.assertIn(f'"value":{shown},', text_of(program, path))
            self.assertRegex(text_of(program, "/metrics"), r'point="tenth",unit=""\} 0\.1\n')
            for path in ("/api/v1/lines", FLOOR[:-1], FLOOR + "trace", PRESS + "points",
                         "/api/v1/simulator/press"):
                self.assertNotRegex(text_of(program, path), r"[:\[,]-?\d[\d.]*[eE][+-]?\d", path)

    def test_a_trace_tells_who_asked_and_when_by_the_clock_on_the_wall(self):
        with harness.configured(PLANT) as program, program.client() as client:
            client.ask(31, harness.read_registers(0))
            program.values(PRESS + "devices/UW0")
            polled(program, "level")
            frames = program.get(FLOOR + "trace?last=500")[1]["frames"]
            now = datetime.datetime.now(datetime.timezone.utc)
            port = client.socket.getsockname()[1]
            whys = "\n".join(frame.get("why", "") for frame in frames)
            self.assertIn(f"read of modbus_tcp 127.0.0.1:{port} to station 31", whys)
            self.assertIn("read of http 127.0.0.1 to station 31", whys)
            self.assertIn("poll of press", whys)
            self.assertNotRegex(whys, r"client \d")
            for frame in frames:
                self.assertRegex(frame["time"], r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{6}Z$")
                at = datetime.datetime.fromisoformat(frame["time"].replace("Z", "+00:00"))
                self.assertLess(abs((now - at).total_seconds()), 3600)
                self.assertIn("at", frame)

    def test_clients_are_known_by_name_and_address(self):
        with harness.configured(PLANT) as program, program.client() as client:
            client.ask(31, struct.pack(">BHH", 3, 0, 1))
            port = client.socket.getsockname()[1]
            names = [c["name"] for c in program.get("/api/v1/lines/floor1")[1]["clients"]]
            self.assertIn(f"modbus_tcp 127.0.0.1:{port}", names)

    def test_who_has_hung_up_is_still_in_the_list_and_shares_add_up(self):
        with harness.configured(PLANT) as program:
            for _ in range(3):  # a connection each, as curl
                program.values(PRESS + "devices/UW0")
                with program.client() as client:
                    client.ask(31, harness.read_registers(0))
            def seen():
                clients = program.get("/api/v1/lines/floor1")[1]["clients"]
                return {c["name"]: c for c in clients}
            while seen().get("modbus_tcp 127.0.0.1", {}).get("requests") != 3:
                text_of(program, "/healthz")  # it has hung up, and that is heard soon
            clients = seen()
            gone = clients["modbus_tcp 127.0.0.1"]
            self.assertGreaterEqual(gone["gone_ms"], 0)
            self.assertGreater(gone["transactions"], 0)
            self.assertGreaterEqual(clients["http 127.0.0.1"]["requests"], 3)
            self.assertIn("poll of press", clients)
            self.assertAlmostEqual(sum(c["percent"] for c in clients.values()), 100, delta=0.5)
            told = re.search(r'bus_busy_seconds_total\{line="floor1"\} (\S+)', text_of(program, "/metrics"))
            self.assertLessEqual(sum(c["busy_seconds"] for c in clients.values()), float(told.group(1)) + 0.001)

    def test_a_client_whose_first_request_is_a_broadcast_has_its_name(self):
        text = config.gateway(FREE_LINE, http=config.ADMIN)
        with harness.configured(text) as program, program.client() as client:
            self.assertEqual(client.ask(0, harness.write_register(10, 1)),
                             harness.write_register(10, 1))
            port = client.socket.getsockname()[1]
            clients = program.get("/api/v1/lines/floor2")[1]["clients"]
            self.assertEqual([c["name"] for c in clients], [f"modbus_tcp 127.0.0.1:{port}"])


if __name__ == "__main__":
    unittest.main()
