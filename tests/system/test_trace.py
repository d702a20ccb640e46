"""The flight recorder: transactions with their instants and frames, incidents, and captures that
tshark reads as Modbus RTU with no preference set."""
import datetime
import itertools
import pathlib
import shutil
import struct
import subprocess
import tempfile
import unittest
import urllib.request

import config
import harness

TSHARK = shutil.which("tshark")
FIELDS = ["frame.comment", "frame.time_epoch", "_ws.col.Protocol", "mbrtu.unit_id", "mbtcp.unit_id", "modbus.func_code",
          "modbus.reference_num", "modbus.word_cnt", "modbus.bit_cnt", "modbus.byte_cnt",
          "modbus.regval_uint16", "modbus.bitval", "modbus.exception_code",
          "modbus.data", "_ws.malformed"]
COLUMN, ITEM = "\x1f", "\x1e"
REGISTERS, BITS = (3, 4), (1, 2)


def fetch(program, path):
    with urllib.request.urlopen(program.url(path), timeout=harness.PATIENCE) as answer:
        return dict(answer.headers), answer.read()


def decoded(capture):
    """What tshark says of each packet: {field: [value, ...]}."""
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "line.pcapng"
        file.write_bytes(capture)
        fields = [word for field in FIELDS for word in ("-e", field)]
        done = subprocess.run(
            [TSHARK, "-n", "-r", str(file), "-T", "fields", *fields, "-E", f"separator={COLUMN}",
             "-E", f"aggregator={ITEM}", "-E", "occurrence=a"],
            capture_output=True, timeout=120, check=True, env={"HOME": folder, "PATH": "/usr/bin:/bin", "LC_ALL": "C.UTF-8"})
    rows = [row.split(COLUMN) for row in done.stdout.decode().split("\n") if row]
    return [{name: cell.split(ITEM) if cell else [] for name, cell in zip(FIELDS, row)} for row in rows]


def bytes_of(frame):
    return bytes.fromhex(frame["bytes"].replace(" ", ""))


def numbers(values):
    return [int(value, 0) for value in values]


class Following(unittest.TestCase):
    """What any run shows, without Wireshark."""

    def test_each_answer_names_transactions_that_the_trace_has(self):
        line = config.line(stations="{id: 31, name: press, profile: autonics-gplp-s}")
        with harness.configured(config.gateway(line, http=config.ADMIN)) as program:
            headers, _ = fetch(program, "/api/v1/stations/press/devices/UW100?count=3")
            (wanted,) = headers["Panelgate-Transactions"].split(", ")
            trace = program.get("/api/v1/lines/floor1/trace")[1]
            (made,) = [one for one in trace["transactions"] if one["id"] == int(wanted)]
            self.assertEqual(made["request"][:17], "1F 03 00 64 00 03")
            self.assertEqual(made["outcome"], "ok")
            self.assertTrue(made["client"].startswith("http 127.0.0.1"))
            instants = [made[name] for name in ("arrived", "granted", "first_bit_out", "last_bit_out",
                                                "first_byte_in", "last_byte_in", "answered")]
            self.assertEqual(instants, sorted(instants))
            frames = [one for one in trace["frames"] if one.get("transaction") == int(wanted)]
            self.assertEqual([one["bytes"] for one in frames], [made["request"], made["reply"]])
            self.assertEqual(frames[0]["sequence"], made["sequence"])

    def test_pages_give_every_transaction_once(self):
        line = config.line(stations="{id: 31, name: press, profile: autonics-gplp-s, "
                                    "poll: [{read: UW0, count: 4, every: 20ms}]}")
        with harness.configured(config.gateway(line, http=config.ADMIN)) as program:
            seen, since = [], 0
            while len(seen) < 100:
                page = program.get(f"/api/v1/lines/floor1/trace?since={since}&last=7")[1]
                seen += [one["id"] for one in page["transactions"]]
                since = page["next"]
            self.assertEqual(seen, list(range(1, len(seen) + 1)))

    def test_a_dead_panel_is_one_incident_with_what_stood_before_it(self):
        line = config.line(retries=0, timing="{response_timeout: 60ms}",
                           stations="{id: 31, name: press, profile: autonics-gplp-s}, "
                                    "{id: 5, name: mixer, profile: autonics-gplp-s, poll: [{read: UW0, every: 50ms}]}")
        with harness.configured(config.gateway(line, http=config.ADMIN)) as program:
            program.rest("GET", "/api/v1/stations/press/devices/UW100")
            self.assertEqual(program.get("/api/v1/lines/floor1/incidents")[1], {"incidents": []})
            program.rest("PUT", "/api/v1/simulator/press", {"dead": True})
            for _ in range(4):
                program.rest("GET", "/api/v1/stations/press/devices/UW100")
            (one,) = program.get("/api/v1/lines/floor1/incidents")[1]["incidents"]
            self.assertEqual((one["id"], one["station"], one["cause"], one["read"]), (1, 31, "timeout", False))
            self.assertGreaterEqual(one["errors"], 3)
            incident = program.get("/api/v1/lines/floor1/incidents/1")[1]
            outcomes = [made["outcome"] for made in incident["transactions"]]
            self.assertIn("ok", outcomes[:outcomes.index("timeout")])
            self.assertTrue(program.get("/api/v1/lines/floor1/incidents")[1]["incidents"][0]["read"])


@unittest.skipUnless(TSHARK, "tshark is not here: deploy/install_packages.sh wireshark")
class Captures(unittest.TestCase):
    def check_frame(self, frame, shown, asked):
        """What tshark shows is what the frame says; `asked`: the last request to that station."""
        adu, station = bytes_of(frame), frame["station"]
        units = numbers(shown["mbrtu.unit_id"] or shown["mbtcp.unit_id"])
        self.assertEqual(units, [station], frame)
        self.assertEqual(numbers(shown["modbus.func_code"]), [adu[1] & 0x7F], frame)
        self.assertEqual(shown["_ws.malformed"], [])
        function, data = adu[1], adu[2:-2]
        if frame["direction"] == "sent":
            address, count = struct.unpack(">HH", data[:4])
            self.assertEqual(numbers(shown["modbus.reference_num"]), [address], frame)
            if function in REGISTERS + (16,):
                self.assertEqual(numbers(shown["modbus.word_cnt"]), [count], frame)
            if function in BITS + (15,):
                self.assertEqual(numbers(shown["modbus.bit_cnt"]), [count], frame)
            if function in (5, 6):
                self.assertEqual(shown["modbus.data"][0].replace(":", ""), adu[4:6].hex(), frame)
            self.assertEqual(bool(shown["mbrtu.unit_id"]), function not in (5, 6) and station != 0, frame)
        elif function & 0x80:
            self.assertEqual(numbers(shown["modbus.exception_code"]), [data[0]], frame)
        if function in REGISTERS and frame["direction"] == "received":
            values = list(struct.unpack(f">{data[0] // 2}H", data[1:]))
            self.assertEqual(numbers(shown["modbus.regval_uint16"]), values, frame)
        if function in BITS and frame["direction"] == "received":
            count = struct.unpack(">H", bytes_of(asked)[4:6])[0]
            bits = [data[1 + i // 8] >> i % 8 & 1 for i in range(count)]
            self.assertEqual(numbers(shown["modbus.bitval"])[:count], bits, frame)

    def test_every_frame_of_the_demo_is_shown_with_unit_function_registers_and_values(self):
        program = harness.demo()
        self.addCleanup(program.stop)
        for path in ("press/devices/UW100?count=5", "press/devices/UB180?count=11", "oven/devices/GDT108",
                     "io/devices/300110", "press/holding-registers/60000"):
            program.rest("GET", "/api/v1/stations/" + path)
        program.rest("PUT", "/api/v1/stations/press/devices/UW120", {"values": [7, 8]})
        program.rest("PUT", "/api/v1/stations/io/devices/400001", {"values": [3]})
        program.rest("POST", "/api/v1/lines/floor1/broadcast", {"table": "holding-registers", "address": 3, "values": [5, 6]})
        before = program.get("/api/v1/lines/floor1/trace?since=0&last=500")[1]["frames"]
        headers, capture = fetch(program, "/api/v1/lines/floor1/trace.pcapng")
        self.assertEqual(headers["Content-Type"], "application/x-pcapng")
        packets = decoded(capture)
        self.assertGreaterEqual(len(packets), len(before))
        functions, asked = set(), None
        for frame, shown in zip(before, packets):
            self.assertIn(str(frame["transaction"]), shown["frame.comment"][0])
            self.assertAlmostEqual(float(shown["frame.time_epoch"][0]), datetime.datetime.fromisoformat(frame["time"].replace("Z", "+00:00")).timestamp(), 5)
            if frame["direction"] == "discarded":
                self.assertIn("discarded: " + frame["note"], "\n".join(shown["frame.comment"]))
                continue
            asked = frame if frame["direction"] == "sent" else asked
            with self.subTest(frame=frame["sequence"]):
                self.check_frame(frame, shown, asked)
            functions.add((frame["direction"], bytes_of(frame)[1]))
        for direction, function in itertools.product(("sent", "received"), (1, 3, 4, 16)):
            self.assertIn((direction, function), functions)
        self.assertIn(("received", 0x83), functions)
        self.assertTrue({("sent", 5), ("sent", 6)} & functions, functions)
        self.assertTrue(any(frame["note"] == "broadcast" for frame in before))

    def test_damaged_and_late_replies_and_decisions_are_comments(self):
        line = config.line(retries=0, timing="{response_timeout: 60ms}",
                           stations="{id: 31, name: press, profile: autonics-gplp-s}, {id: 5, name: mixer, profile: autonics-gplp-s}")
        with harness.configured(config.gateway(line, http=config.ADMIN)) as program:
            program.rest("PUT", "/api/v1/simulator/press", {"damage": 1})
            program.rest("GET", "/api/v1/stations/press/devices/UW100")
            program.rest("PUT", "/api/v1/simulator/press", {"damage": 0})
            program.rest("PUT", "/api/v1/simulator/mixer", {"late": 1, "late_by_ms": 120})
            program.rest("GET", "/api/v1/stations/mixer/devices/UW100")
            for _ in range(100):  # each takes the time of a read
                program.rest("GET", "/api/v1/stations/press/devices/UW100")
                if any(one["note"] == "late" for one in program.get("/api/v1/lines/floor1/trace?last=500")[1]["frames"]):
                    break
            packets = decoded(fetch(program, "/api/v1/lines/floor1/trace.pcapng")[1])
            of_incident = decoded(fetch(program, "/api/v1/lines/floor1/incidents/1.pcapng")[1])
        comments = [" / ".join(packet["frame.comment"]) for packet in packets]
        damaged = [one for one, said in zip(packets, comments) if "discarded: damaged" in said]
        self.assertTrue(damaged)
        for packet in damaged:
            self.assertEqual(packet["mbrtu.unit_id"], [], "nobody takes it for a reply")
        self.assertTrue(any("discarded: late" in said for said in comments), comments)
        self.assertTrue(any("next in turn" in said for said in comments), comments)
        self.assertTrue(any("discarded: damaged" in " ".join(one["frame.comment"]) for one in of_incident))


if __name__ == "__main__":
    unittest.main()
