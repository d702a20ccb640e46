"""The audit: what is on the wire is in it, also after kill -9, and nothing in it can be changed
without being found. AUDIT_WRITES, AUDIT_KILLS and AUDIT_TAMPERINGS say how much is tried."""
import http.client
import json
import os
import pathlib
import random
import re
import resource
import socket
import struct
import tempfile
import threading
import time
import unittest

import harness
from harness import adu, crc, read_registers, write_register

WRITES = int(os.environ.get("AUDIT_WRITES", "300"))
KILLS = int(os.environ.get("AUDIT_KILLS", "2"))
TAMPERINGS = int(os.environ.get("AUDIT_TAMPERINGS", "50"))
THINKS = 0.015 if WRITES < 1000 else 0.002  # seconds of the panel, so that a run outlasts what a kill may take
CLIENTS = 8
STATION = 7
UNVERIFIED = 1.0  # seconds before a kill whose records may be missing

CONFIG = """lines:
  - name: floor1
    device: tcp://127.0.0.1:{bus}
    serial: {{baud: 115200}}
    timing: {{frame_gap: 0us}}
    stations: [{{id: 7, name: press}}, {{id: 8, name: meter, access: read_only}}]
modbus_tcp: [{{listen: "127.0.0.1:{modbus}", udp: true}}]
http: {{listen: "127.0.0.1:{http}", anonymous: {anonymous}}}
audit: {{file: {folder}/audit.jsonl, rotate: 64KiB, keep: 1000, on_failure: {on_failure}}}
"""


class Bus:
    """The far end of a tcp:// line: a panel that takes every write, and remembers when."""

    def __init__(self):
        self.writes = []  # (monotonic time, address, value)
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port = self._server.getsockname()[1]
        self._ended = False
        self._thinking = threading.Event()  # never set
        threading.Thread(target=self._accept, daemon=True).start()

    def close(self):
        self._ended = True
        self._server.close()

    def _accept(self):
        while not self._ended:
            try:
                connection, _ = self._server.accept()
            except OSError:
                return
            threading.Thread(target=self._serve, args=(connection,), daemon=True).start()

    def _serve(self, connection):
        data = b""
        with connection:
            while True:
                try:
                    more = connection.recv(4096)
                except OSError:
                    return
                if not more:
                    return
                data += more
                while (length := frame_length(data)) and len(data) >= length:
                    frame, data = data[:length], data[length:]
                    reply = self._answer(frame)
                    self._thinking.wait(THINKS)
                    try:
                        connection.sendall(reply + crc(reply))
                    except OSError:
                        return

    def _answer(self, frame):
        station, function, address, value = struct.unpack(">BBHH", frame[:6])
        if function == 3:
            return struct.pack(f">BBB{value}H", station, 3, 2 * value, *([0] * value))
        if function == 16:
            value = struct.unpack(">H", frame[7:9])[0]
        self.writes.append((time.monotonic(), address, value))
        return frame[:6]


def frame_length(data):
    if len(data) < 8:
        return 0
    return 9 + data[6] if data[1] == 16 else 8


def free_ports(count):
    """Ports that were free: the gateway must have the same ones after each kill."""
    sockets = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports


class Writer(threading.Thread):
    """A client that writes its numbers one after the other, over its face, until each is answered
    or may have been written."""

    def __init__(self, number, count, ports, progress):
        super().__init__(daemon=True)
        self.number, self.count, self.ports, self.progress = number, count, ports, progress
        self._link = None

    def run(self):
        for i in range(self.count):
            while not self._write(self.number * 1000 + i % 1000, i):
                self.hang_up()
                self.progress.wait_for_gateway()
            self.progress.step()
        self.hang_up()

    def hang_up(self):
        if self._link is not None:
            self._link.close()
        self._link = None

    def _write(self, address, value):
        try:
            return (self._tcp, self._udp, self._rest)[self.number % 3](address, value)
        except (OSError, harness.Closed, TimeoutError):
            return False

    def _tcp(self, address, value):
        if self._link is None:
            self._link = harness.Client(self.ports[0], patience=5)
        return self._link.ask(STATION, write_register(address, value))[0] == 6

    def _udp(self, address, value):
        if self._link is None:
            self._link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self._link.settimeout(3)
            self._link.connect(("127.0.0.1", self.ports[0]))
        self._link.send(adu(value + 1, STATION, write_register(address, value)))
        return self._link.recv(300)[7] == 6

    def _rest(self, address, value):
        if self._link is None:
            self._link = http.client.HTTPConnection("127.0.0.1", self.ports[1], timeout=5)
        try:
            self._link.request("PUT", f"/api/v1/stations/press/holding-registers/{address}",
                               json.dumps({"values": [value]}))
            answer = self._link.getresponse()
            answer.read()
        except http.client.HTTPException as error:
            raise OSError from error
        return answer.status == 200


class Progress:
    def __init__(self):
        self._changed = threading.Condition()
        self._done = 0
        self._up = threading.Event()

    def step(self):
        with self._changed:
            self._done += 1
            self._changed.notify_all()

    def wait_for(self, count):
        with self._changed:
            if not self._changed.wait_for(lambda: self._done >= count, 10 * harness.PATIENCE):
                raise AssertionError(f"only {self._done} of {count} writes")

    def up(self, is_up):
        self._up.set() if is_up else self._up.clear()

    def wait_for_gateway(self):
        self._up.wait(harness.PATIENCE)


def in_order(folder):
    """The files of an audit, the oldest first."""
    full = sorted(folder.glob("audit.jsonl.*"))
    return [*full, folder / "audit.jsonl"]


def records(folder):
    return [json.loads(line) for file in in_order(folder) for line in file.read_text().splitlines()]


def verify(folder, *more):
    return harness.run("audit", "verify", *map(str, in_order(folder)), *more)


class Wire(unittest.TestCase):
    """Many clients, kills between, and then somebody who wants it to have been otherwise."""

    @classmethod
    def setUpClass(cls):
        cls.box = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.box.name)
        cls.bus = Bus()
        modbus, http = free_ports(2)
        file = cls.folder / "panelgate.yaml"
        file.write_text(CONFIG.format(bus=cls.bus.port, modbus=modbus, http=http, folder=cls.folder,
                                      anonymous="operator", on_failure="continue"))
        cls.kills, cls.logs = [], []
        progress = Progress()
        writers = [Writer(i, WRITES // CLIENTS, (modbus, http), progress) for i in range(CLIENTS)]
        for round_ in range(KILLS + 1):
            with harness.Program("run", "-c", str(file)) as program:
                program.http_port()
                progress.up(True)
                for writer in writers if round_ == 0 else ():
                    writer.start()
                progress.wait_for(WRITES // CLIENTS * CLIENTS * (round_ + 1) // (KILLS + 1))
                progress.up(False)
                if round_ < KILLS:
                    program.ends_with = -9
                    program.process.kill()
                    program.wait()
                    cls.kills.append(time.monotonic())
            cls.logs.append(program.log.finished_text())
        for writer in writers:
            writer.join(harness.PATIENCE)
        cls.log = cls.folder / "log"
        cls.log.write_text("\n".join(cls.logs) + "\n")

    @classmethod
    def tearDownClass(cls):
        cls.bus.close()
        cls.box.cleanup()

    def test_every_write_on_the_wire_is_recorded(self):
        recorded = {}
        for record in records(self.folder):
            if record["kind"] == "write" and record["outcome"] in ("confirmed", "unknown"):
                key = record["address"], record["values"][0]
                recorded[key] = recorded.get(key, 0) + 1
        missing = []
        # Who got no answer because of a kill wrote again: the later one is the recorded one.
        for when, address, value in reversed(self.bus.writes):
            if recorded.get((address, value), 0) > 0:
                recorded[address, value] -= 1
            else:
                missing.append(when)
        # The bus reads what was sent last after the kill.
        late = [when for when in missing
                if not any(-0.5 <= kill - when <= UNVERIFIED for kill in self.kills)]
        self.assertEqual(late, [], f"{len(missing)} of {len(self.bus.writes)} are missing")
        self.assertGreaterEqual(len(self.bus.writes), WRITES // CLIENTS * CLIENTS)
        print(f"{len(self.bus.writes)} writes on the wire, {len(self.kills)} kills, "
              f"{len(missing)} in the last second before one are not in the audit")

    def test_all_faces_are_told_apart(self):
        faces = {record.get("face") for record in records(self.folder) if record["kind"] == "write"}
        self.assertEqual(faces, {"modbus_tcp", "udp", "http"})

    def test_what_may_be_missing_is_said(self):
        done = verify(self.folder, "--log", str(self.log))
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertEqual(done.stdout.count("did not end in order"), KILLS, done.stdout)
        starts = [record for record in records(self.folder) if record["kind"] == "start"]
        self.assertEqual([record.get("unclean", False) for record in starts],
                         [False] + [True] * KILLS)

    def test_numbers_have_no_gap_over_all_files(self):
        numbers = [record["n"] for record in records(self.folder)]
        self.assertEqual(numbers, list(range(1, len(numbers) + 1)))
        self.assertGreater(len(in_order(self.folder)), 1)

    def test_each_tampering_is_found(self):
        dice = random.Random(29)
        originals = {file: file.read_bytes() for file in in_order(self.folder)}
        for number in range(TAMPERINGS):
            file = dice.choice(list(originals))
            changed = tampered(originals[file], dice)
            if changed == originals[file]:
                continue
            try:
                file.write_bytes(changed)
                done = verify(self.folder, "--log", str(self.log))
            finally:
                file.write_bytes(originals[file])
            self.assertEqual(done.returncode, 1, f"{number}: {done.stdout}")
            self.assertRegex(done.stdout, r"(changed|removed|added|torn|anchor): ")
        self.assertEqual(verify(self.folder, "--log", str(self.log)).returncode, 0)


def tampered(text, dice):
    """A file in which somebody changed, removed, added or moved something."""
    lines = text.splitlines(keepends=True)
    i, j = dice.randrange(len(lines)), dice.randrange(len(lines))
    kind = dice.randrange(7)
    if kind == 0:  # another value, with everything else as it was
        at = dice.randrange(len(lines[i]) - 1)
        lines[i] = lines[i][:at] + bytes([lines[i][at] ^ 1 << dice.randrange(7)]) + lines[i][at + 1:]
    elif kind == 1:
        del lines[i]
    elif kind == 2:
        lines.insert(j, lines[i])
    elif kind == 3:
        lines[i], lines[j] = lines[j], lines[i]
    elif kind == 4:  # the end is cut off
        lines = lines[:max(i, 1) if i < len(lines) - 1 else -1]
    elif kind == 5:  # a record that never was
        lines.insert(j, re.sub(rb'"n":\d+', b'"n":%d' % dice.randrange(1, 10000), lines[i]))
    else:
        cut = dice.randrange(1, len(lines[i]))
        lines[i] = lines[i][:cut - 1] + lines[i][cut:]
    return b"".join(lines)


class Case(unittest.TestCase):
    """A gateway with an audit, whose folder is not there yet."""

    def setUp(self):
        box = tempfile.TemporaryDirectory()
        self.addCleanup(box.cleanup)
        self.folder = pathlib.Path(box.name) / "audit"
        self.bus = Bus()
        self.addCleanup(self.bus.close)
        self.file = pathlib.Path(box.name) / "panelgate.yaml"

    def write_config(self, on_failure="continue", anonymous="operator"):
        self.file.write_text(CONFIG.format(bus=self.bus.port, modbus=0, http=0, folder=self.folder,
                                           anonymous=anonymous, on_failure=on_failure))

    def gateway(self, **options):
        return harness.Program("run", "-c", str(self.file), **options)


class Refusing(Case):
    def test_writes_are_refused_while_they_cannot_be_recorded(self):
        self.write_config("refuse_writes")
        with self.gateway() as program, program.client() as client:
            program.log.wait_for("audit fails .*No such file.* writes=\"are refused\"")
            self.assertEqual(client.ask(STATION, write_register(1, 2)), b"\x86\x06")
            self.assertEqual(client.ask(STATION, read_registers(1)), b"\x03\x02\x00\x00")
            status, body = program.rest("PUT", "/api/v1/stations/press/holding-registers/1",
                                        {"values": [2]})
            self.assertEqual((status, body["rule"], body["transmitted"]), (503, "audit", False))
            self.assertIn("panelgate_audit_up 0\n", program.get("/metrics")[1])
            self.assertEqual(self.bus.writes, [])
            self.folder.mkdir()
            program.log.wait_for("audit recovered")
            self.assertEqual(client.ask(STATION, write_register(1, 2)), write_register(1, 2))
            self.assertIn("panelgate_audit_up 1\n", program.get("/metrics")[1])
        self.assertEqual(verify(self.folder).returncode, 0)
        refused = [one for one in records(self.folder) if one.get("rule") == "audit"]
        self.assertGreaterEqual(len(refused), 1)

    def test_a_full_disk_loses_nothing_that_has_room_in_the_buffer(self):
        self.write_config()
        self.folder.mkdir()

        def fill():
            resource.setrlimit(resource.RLIMIT_FSIZE, (5000, resource.RLIM_INFINITY))

        with self.gateway(preexec_fn=fill) as program, program.client() as client:
            for i in range(40):
                client.ask(STATION, write_register(i, i))
            program.log.wait_for("audit fails .*File too large")
            for i in range(40, 60):  # they go on, and are recorded later
                self.assertEqual(client.ask(STATION, write_register(i, i)), write_register(i, i))
            resource.prlimit(program.process.pid, resource.RLIMIT_FSIZE,
                             (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
            program.log.wait_for("audit recovered")
        self.assertEqual(verify(self.folder).returncode, 0)
        written = [one["address"] for one in records(self.folder) if one["kind"] == "write"]
        self.assertEqual(written, list(range(60)))

    def test_one_client_cannot_fill_it_with_what_is_refused(self):
        self.write_config()
        self.folder.mkdir()
        with self.gateway() as program, program.client() as client:
            for i in [*range(200), *[7] * 100]:
                self.assertEqual(client.ask(8, write_register(i, i)), b"\x86\x01")
        kept = [one for one in records(self.folder) if one["kind"] in ("write", "repeats")]
        self.assertEqual([one["kind"] for one in kept], ["write"] * 64 + ["repeats"] * 2, "each place once")
        counts = {one["at"]: (one["count"], one.get("rule")) for one in kept if one["kind"] == "repeats"}
        self.assertEqual(counts, {kept[7]["at"]: (100, "access"), "other places": (136, None)})

    def test_a_write_that_leads_to_no_station_is_recorded_once(self):
        self.write_config()
        self.folder.mkdir()
        with self.gateway() as program, program.client() as client:
            for unit, code in ((250, 0x0A), (255, 0x0A)):
                for _ in range(3):
                    self.assertEqual(client.ask(unit, write_register(4, 5)), bytes([0x86, code]))
                client.ask(unit, read_registers(1))
        stray = [(one["kind"], one["unit"], one["function"], one.get("pdu"), one.get("count"), one["outcome"])
                 for one in records(self.folder) if "unit" in one]
        self.assertEqual(sorted(stray, key=str), sorted(
            (row for unit in (250, 255) for row in (("refusal", unit, 6, "0600040005", None, "refused"),
                                                   ("repeats", unit, 6, None, 2, "refused"))), key=str))

    def test_reload_tells_who_changed_what_and_goes_on_in_another_file(self):
        self.write_config(anonymous="admin")
        self.folder.mkdir()
        with self.gateway() as program, program.client() as client:
            program.http_port()
            client.ask(STATION, write_register(4, 5))  # just before: it is told first
            text = self.file.read_text().replace("audit.jsonl", "other.jsonl")
            self.file.write_text(text.replace("access: read_only", "access: read_write"))
            status, body = program.rest("POST", "/api/v1/reload", {})
            self.assertEqual((status, body["outcome"]), (200, "applied"))
        first = records(self.folder)
        self.assertEqual([one["kind"] for one in first], ["file", "start", "write", "reload", "end"])
        self.assertEqual(first[3]["cause"], "http 127.0.0.1")
        self.assertTrue(any("read_only -> read_write" in one for one in first[3]["changes"]))
        other = self.folder / "other.jsonl"
        self.assertEqual(harness.run("audit", "verify", str(other)).returncode, 0)
        shown = harness.run("audit", "show", "-c", str(self.file), "--kind", "end")
        self.assertEqual(shown.returncode, 0, shown.stderr)

    def test_show_finds_what_was_done_to_a_station_however_it_is_named(self):
        self.write_config()
        self.folder.mkdir()
        with self.gateway() as program, program.client() as client:
            for unit in (STATION, 77, 8):
                client.ask(unit, write_register(1, 2))
            client.ask(0, write_register(2, 3))

        def shown(*more, files=("-c", str(self.file))):
            done = harness.run("audit", "show", *files, "--json", *more)
            return done.returncode, [json.loads(one)["id"] for one in done.stdout.splitlines()], done.stderr

        for typed in ("press", "7", "floor1/7", "floor1:7"):
            self.assertEqual(shown("--station", typed)[:2], (0, [7, 0]), typed)
        self.assertEqual(shown("--station", "floor1/77")[:2], (0, [77, 0]))
        self.assertEqual(shown("--station", "floor1/77", files=(str(self.folder / "audit.jsonl"),))[:2], (0, [77, 0]))
        code, ids, said = shown("--station", "pres")
        self.assertEqual((code, ids), (1, []))
        self.assertIn("did you mean 'press'?", said)
        code, _, said = shown("--kind", "wirte")
        self.assertEqual(code, 64)
        self.assertIn("did you mean 'write'?", said)

    def test_each_unknown_token_is_told_beside_other_refusals(self):
        self.write_config(anonymous="none")
        self.folder.mkdir()
        with self.gateway() as program:
            for i in range(80):
                program.get(f"/api/v1/stations/press/holding-registers/{i}")
            link = http.client.HTTPConnection("127.0.0.1", program.http_port(), timeout=5)
            link.request("GET", "/api/v1/lines", headers={"Authorization": "Bearer guessed"})
            self.assertEqual(link.getresponse().status, 401)
            link.close()
        kinds = [one["kind"] for one in records(self.folder)]
        self.assertEqual((kinds.count("refusal"), kinds.count("login")), (64, 1))

    def test_commands_say_what_is_wrong(self):
        missing = str(self.folder / "none")
        for command in (["verify", missing], ["show", missing], ["verify", "--log", missing, "/dev/null"]):
            done = harness.run("audit", *command)
            self.assertEqual((done.returncode, done.stdout), (66, ""), done.stderr)
            self.assertIn("cannot read", done.stderr)
        empty = harness.run("audit", "verify", "/dev/null")
        self.assertEqual((empty.returncode, empty.stdout), (1, "there is no record\n"))
        wrong = harness.run("audit", "show", "--since", "yesterday", "/dev/null")
        self.assertEqual(wrong.returncode, 64)
        self.assertIn("30min, 1h or 7d", wrong.stderr)


if __name__ == "__main__":
    unittest.main()
