"""`panelgate demo`: five panels, asked by foreign clients and by the pasted hints, and the frames
of the manuals on the wire, byte for byte."""
import json
import re
import struct
import subprocess
import time
import unittest

from pymodbus.client import ModbusTcpClient

import config
import harness
import vectors

LINE = "floor1"
# What a technician types: station, unit, notation, table (as mbpoll -t), address on the wire.
NOTATIONS = [
    ("press", 31, "UW100", 4, 100),
    ("press", 31, "UB180", 0, 288),
    ("mixer", 5, "UW100", 4, 100),
    ("oven", 20, "GDT108", 4, 108),
    ("oven", 20, "GR20", 0, 32),
    ("filler", 1, "W0.00", 0, 0),
    ("filler", 1, "D0", 4, 0),
    ("io", 17, "400001", 4, 0),
    ("io", 17, "300110", 3, 109),
]
# The manuals' GP/LP examples use two station numbers; these are the ones that the demo gives to
# another panel.
OTHER_STATIONS = config.gateway(
    config.line(stations="{id: 5, name: lp, profile: autonics-gplp-s}, "
                         "{id: 31, name: gp, profile: autonics-gp-2005}"),
    http=config.ADMIN)
# Replies that no Modbus/TCP reply can hold; REST may ask for them.
TOO_LARGE_FOR_TCP = {"gt_fc01_gr20_2040bits", "gt_fc03_gdt108_127words"}
# 2047 coils need 256 data bytes, which a byte count cannot say: refused, never on the wire.
IMPOSSIBLE = {"cp2e_fc01_w0_00_to_w127_14"}


def in_demo(vector):
    station, name = vectors.request(vector)[0], vector["name"]
    return not ((name.startswith("gplp_") and station == 5) or
                (name.startswith("gp2005_") and station == 31))


class Demo(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.program = harness.demo()
        cls.addClassCleanup(cls.program.stop)
        cls.program.http_port()
        cls.mbpoll = ["mbpoll", "-m", "tcp", "-p", str(cls.program.modbus_port()), "-1", "-0"]

    def test_the_printed_hints_work_as_pasted(self):
        self.program.out.wait_for("Ctrl-C")
        hints = re.findall(r"(?m)^ +((?:curl|mbpoll) .*)$", self.program.out.text())
        self.assertGreaterEqual(sum(h.startswith("curl") for h in hints), 3)
        self.assertGreaterEqual(sum(h.startswith("mbpoll") for h in hints), 1)
        for hint in hints:
            with self.subTest(hint=hint):
                done = subprocess.run(["bash", "-c", hint], capture_output=True, text=True,
                                      timeout=harness.PATIENCE, check=True)
                if hint.startswith("curl"):
                    self.assertNotIn("problem", json.loads(done.stdout).get("type", ""))
                    self.assertNotIn("status", json.loads(done.stdout))

    def test_five_panels_are_listed(self):
        status, body = self.program.get("/api/v1/stations")
        self.assertEqual(status, 200)
        seen = {(s["name"], s["id"], s["profile"], s["line"]) for s in body["stations"]}
        self.assertEqual(seen, {
            ("press", 31, "autonics-gplp-s", LINE), ("mixer", 5, "autonics-gp-2005", LINE),
            ("io", 17, "autonics-arm", LINE), ("oven", 20, "panasonic-gt", LINE),
            ("filler", 1, "omron-cp2e", LINE)})

    def test_rest_pymodbus_and_mbpoll_read_the_same_values(self):
        with ModbusTcpClient("127.0.0.1", port=self.program.modbus_port()) as client:
            for station, unit, notation, table, address in NOTATIONS:
                with self.subTest(station=station, notation=notation):
                    path = f"/api/v1/stations/{station}/devices/{notation}"
                    if table in (0, 4):  # a value that only we change
                        status, body = self.program.rest("PUT", path, {"values": [1]})
                        self.assertEqual((status, body.get("confirmed")), (200, True), body)
                    values = self.program.values(path)
                    self.assertEqual(values, self.by_pymodbus(client, unit, table, address))
                    self.assertEqual(values, self.by_mbpoll(unit, table, address))

    def by_pymodbus(self, client, unit, table, address):
        read = {0: client.read_coils, 3: client.read_input_registers,
                4: client.read_holding_registers}[table]
        reply = read(address, 1, slave=unit)
        self.assertFalse(reply.isError(), reply)
        return [int(reply.bits[0])] if table == 0 else reply.registers

    def by_mbpoll(self, unit, table, address):
        done = subprocess.run(
            [*self.mbpoll, "-a", str(unit), "-t", str(table), "-r", str(address), "127.0.0.1"],
            capture_output=True, text=True, timeout=harness.PATIENCE, check=False)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return [int(value) for value in re.findall(r"(?m)^\[\d+\]:\s+(\d+)", done.stdout)]

    def test_the_metrics_are_valid_and_name_every_station(self):
        status, text = self.program.get("/metrics")
        self.assertEqual(status, 200)
        for station in ("press", "mixer", "io", "oven", "filler"):
            self.assertIn(f'station="{station}"', text)
        checked = subprocess.run(["promtool", "check", "metrics"], input=text, capture_output=True,
                                 text=True, timeout=harness.PATIENCE, check=False)
        self.assertEqual(checked.returncode, 0, checked.stdout + checked.stderr)

    def test_each_panel_is_asked_for_something_so_that_it_is_seen_to_live(self):
        self.becomes("/api/v1/stations", lambda body: all(
            station["state"] == "online" for station in body["stations"]))

    def test_points_a_poll_and_a_relay_live_in_it(self):
        listing = self.program.get("/api/v1/stations")[1]["stations"]
        with_points = 0
        for station in listing:
            path = f"/api/v1/stations/{station['name']}/points"
            points = self.program.get(path)[1]["points"]
            with_points += bool(points)
            for point in points:
                self.becomes(f"{path}/{point['name']}", lambda body: body["quality"] == "good")
        self.assertGreaterEqual(with_points, 2)
        [relay] = self.becomes("/api/v1/relays", lambda body: body["relays"][0]["state"] == "ok")[
            "relays"]
        self.assertIn("filler", json.dumps(relay))
        self.becomes("/api/v1/stations/filler/devices/D200?count=2",
                     lambda body: body["source"] == "cache")

    def becomes(self, path, wanted):
        deadline = time.monotonic() + harness.PATIENCE
        while True:
            status, body = self.program.get(path)
            self.assertEqual(status, 200, body)
            if wanted(body):
                return body
            self.assertLess(time.monotonic(), deadline, body)

    def test_P10_looking_at_the_gateway_never_uses_the_bus(self):
        with harness.configured(config.gateway(config.line())) as program:
            program.values("/api/v1/stations/press/devices/UW0")
            before = program.trace(LINE)
            self.assertTrue(before)
            for path in ("/metrics", "/api/v1/lines", "/api/v1/stations", "/readyz", "/healthz"):
                self.assertEqual(program.get(path)[0], 200)
            self.assertEqual(program.trace(LINE), before)


class Frames(unittest.TestCase):
    """Every frame of part 7, corrected where the manual prints a wrong CRC."""

    def exchange(self, program, vector):
        request = vectors.request(vector)
        unit, pdu = request[0], request[1:-2]
        if vector["name"] in TOO_LARGE_FOR_TCP | IMPOSSIBLE:
            self.assertEqual(self.client.ask(unit, pdu), bytes([pdu[0] | 0x80, 3]))
            self.assertNotIn(("sent", request), program.trace(LINE))
            status, body = program.rest("POST", f"/api/v1/lines/{LINE}/raw",
                                        {"station": unit, "pdu": pdu.hex().upper()})
            if vector["name"] in IMPOSSIBLE:
                self.assertNotEqual(status, 200, body)
                self.assertNotIn(("sent", request), program.trace(LINE))
                return None
            self.assertEqual(status, 200, body)
            return bytes.fromhex(body["pdu"])
        return self.client.ask(unit, pdu)

    def judge(self, program, vector):
        request, expected = vectors.request(vector), vectors.response(vector)
        reply = self.exchange(program, vector)
        if reply is None:
            return
        frames = program.trace(LINE)
        sent = max(i for i, frame in enumerate(frames) if frame == ("sent", request))
        if request[0] == 0:  # nobody answers a broadcast; the client gets the function's reply
            self.assertEqual(reply, request[1:-2])
            after = [(way, frame) for way, frame in frames[sent + 1:sent + 2] if way == "received"]
            self.assertEqual(after, [])
            return
        received = [data for direction, data in frames[sent + 1:] if direction == "received"][0]
        self.assertEqual(received, harness.rtu(request[0], reply))
        if expected:
            self.assertEqual(received, expected)
        else:  # the manual shows no reply: it is a normal one
            self.assertEqual(reply[0], request[1])

    def judge_all(self, program, wanted):
        self.assertTrue(wanted)
        with program.client() as self.client:
            for vector in wanted:
                with self.subTest(vector=vector["name"]):
                    self.judge(program, vector)

    def test_the_manuals_frames_come_out_byte_for_byte(self):
        with harness.demo() as program:
            self.judge_all(program, [v for v in vectors.load(7) if in_demo(v)])

    def test_the_other_station_numbers_of_the_manuals_do_too(self):
        with harness.configured(OTHER_STATIONS, "--simulate") as program:
            self.judge_all(program, [v for v in vectors.load(7) if not in_demo(v)])

    def by_notation(self, program, station, request):
        """The same through REST, as a technician would type it: [frames sent] or None when no
        notation leads to this function."""
        function, address, count = struct.unpack(">BHH", request[1:6])
        table = {1: "coils", 5: "coils", 15: "coils", 2: "discrete-inputs", 3: "holding-registers",
                 6: "holding-registers", 16: "holding-registers", 4: "input-registers"}[function]
        size = 1 if function in (5, 6) else count
        status, body = program.get(f"/api/v1/stations/{station}/{table}/{address}?count=1")
        if status != 200 or not body["notation"]:
            return None
        path = f"/api/v1/stations/{station}/devices/{body['notation']}"
        if function <= 4:
            status, body = program.get(f"{path}?count={size}")
        else:
            if function in (5, 6):
                values = [count if function == 6 else int(count == 0xFF00)]
            elif function == 16:
                values = struct.unpack(f">{count}H", request[7:7 + 2 * count])
            else:
                values = [request[7 + i // 8] >> i % 8 & 1 for i in range(count)]
            status, body = program.rest("PUT", path, {"values": list(values)})
        self.assertEqual(status, 200, (path, body))
        return [frame for way, frame in program.trace(LINE, 20) if way == "sent"]

    def test_the_manuals_frames_come_out_of_rest_by_notation(self):
        names = {31: "press", 5: "mixer", 17: "io", 20: "oven", 1: "filler"}
        reproduced, other = [], []
        with harness.demo() as program:
            for vector in (v for v in vectors.load(7) if in_demo(v)):
                request, response = vectors.request(vector), vectors.response(vector)
                exception = response and response[1] & 0x80
                if request[0] not in names or exception or vector["name"] in IMPOSSIBLE:
                    continue
                with self.subTest(vector=vector["name"]):
                    sent = self.by_notation(program, names[request[0]], request)
                    # The demo's own polls go on beside.
                    (reproduced if sent and request in sent else other).append(vector["name"])
        print(f"\n  {len(reproduced)} frames by notation; by another function: {', '.join(other)}")
        self.assertGreaterEqual(len(reproduced), 15)

    def test_raw_takes_and_gives_the_same_bytes(self):
        by_name = {vector["name"]: vector for vector in vectors.load(7)}
        with harness.demo() as program:
            for name in ("gplp_fc01_ub180_5bits", "gplp_fc03_uw0_5words", "gp2005_exception_fc04",
                         "arm_fc01_coils_1_10", "arm_exception_coil_1001", "gt_fc06_gdt510_1234"):
                request, response = (f(by_name[name]) for f in (vectors.request, vectors.response))
                status, body = program.rest("POST", f"/api/v1/lines/{LINE}/raw",
                                            {"station": request[0], "pdu": request[1:-2].hex()})
                self.assertEqual((status, body["pdu"]), (200, response[1:-2].hex().upper()), name)
                self.assertEqual("exception" in body, bool(response[1] & 0x80), name)


if __name__ == "__main__":
    unittest.main()
