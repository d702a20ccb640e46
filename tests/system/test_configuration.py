"""The configuration file over REST: read, judged, written, put back; the file stays the truth."""
import contextlib
import hashlib
import http.client
import json
import os
import pathlib
import socket
import tempfile
import threading
import time
import unittest

import config
import harness
from rest_plant import tokens
from test_reload import Running

TEXT = "/api/v1/configuration/text"
COMMENT = "# The press of hall 1, do not touch\n"
MIXER = "{id: 5, name: mixer, profile: autonics-gp-2005}"


def plant(*stations, http=config.ADMIN, **keys):
    return COMMENT + config.gateway(config.line(stations=", ".join([config.PRESS, *stations])), http=http, **keys)


def ask(program, method, path, body=None, match=None, token=None):
    """(status, headers, JSON or text). `body`: a text."""
    headers = {"Content-Type": "text/yaml"}
    if match:
        headers["If-Match"] = match
    if token:
        headers["Authorization"] = f"Bearer token-of-{token}-0123456789"
    with contextlib.closing(http.client.HTTPConnection("127.0.0.1", program.http_port(), timeout=harness.PATIENCE)) as way:
        way.request(method, path, body.encode() if isinstance(body, str) else body, headers)
        response = way.getresponse()
        text = response.read().decode()
        parsed = json.loads(text) if "json" in response.headers.get("Content-Type", "") else text
        return response.status, response.headers, parsed


def etag(text):
    return f'"{hashlib.sha256(text.encode()).hexdigest()}"'


class File(unittest.TestCase):
    def test_it_is_read_as_it_is_with_its_hash(self):
        with Running(plant()) as running:
            status, headers, text = ask(running.program, "GET", TEXT)
            self.assertEqual((status, text, headers["ETag"]), (200, plant(), etag(plant())))
            self.assertIn("PUT", headers["Allow"])
            self.assertEqual(running.program.get("/api/v1/configuration")[1]["text"], {"writable": True})

    def test_a_valid_text_is_written_and_runs_and_there_is_a_way_back(self):
        with Running(plant()) as running:
            running.file.chmod(0o640)
            program = running.program
            status, headers, said = ask(program, "PUT", TEXT, plant(MIXER), etag(plant()))
            self.assertEqual((status, said["applied"]), (200, True))
            self.assertEqual(said["changes"], [{"path": "lines/floor1/stations/mixer", "kind": "added"}])
            self.assertEqual(headers["ETag"], etag(plant(MIXER)))
            self.assertEqual(running.file.read_text(), plant(MIXER))
            self.assertEqual(running.file.stat().st_mode & 0o777, 0o640)
            self.assertEqual([one.name for one in running.file.parent.iterdir()], ["panelgate.yaml"])
            self.assertEqual(program.get("/api/v1/stations/mixer")[0], 200)
            versions = program.get("/api/v1/configuration/versions")[1]["versions"]
            self.assertEqual([(one["version"], one["who"]) for one in versions], [(2, "http 127.0.0.1"), (1, "start")])
            self.assertEqual(f'"{versions[1]["sha256"]}"', etag(plant()))
            self.assertEqual(ask(program, "GET", "/api/v1/configuration/versions/1")[2], plant())
            status, _, said = ask(program, "POST", "/api/v1/configuration/rollback", '{"version": 1}')
            self.assertEqual((status, said["changes"][0]["kind"]), (200, "removed"))
            self.assertEqual(running.file.read_text(), plant())
            self.assertEqual(program.get("/api/v1/stations/mixer")[0], 404)

    def test_ten_texts_are_kept(self):
        with Running(plant()) as running:
            for i in range(12):
                self.assertEqual(ask(running.program, "PUT", TEXT, plant() + f"# {i}\n", "*")[0], 200)
            versions = running.program.get("/api/v1/configuration/versions")[1]["versions"]
            self.assertEqual([one["version"] for one in versions], list(range(13, 3, -1)))

    def test_whoever_has_not_seen_the_last_change_writes_nothing(self):
        with Running(plant()) as running:
            self.assertEqual(ask(running.program, "PUT", TEXT, plant(MIXER))[0], 428)
            running.file.write_text(plant() + "# by ssh\n")
            status, headers, said = ask(running.program, "PUT", TEXT, plant(MIXER), etag(plant()))
            self.assertEqual((status, headers["ETag"]), (412, etag(plant() + "# by ssh\n")), said)
            self.assertEqual(running.file.read_text(), plant() + "# by ssh\n")

    def test_of_two_at_once_one_writes(self):
        with Running(plant()) as running:
            texts = [plant() + f"# {who}\n" for who in range(8)]
            came = [None] * len(texts)

            def write(i):
                came[i] = ask(running.program, "PUT", TEXT, texts[i], etag(plant()))[0]

            threads = [threading.Thread(target=write, args=(i,)) for i in range(len(texts))]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            self.assertEqual(sorted(came), [200] + [412] * 7)
            self.assertEqual(running.file.read_text(), texts[came.index(200)])

    def test_a_text_with_faults_is_told_at_its_places_and_not_written(self):
        with Running(plant()) as running:
            wrong = plant().replace("profile:", "profil:")
            status, _, said = ask(running.program, "PUT", TEXT, wrong, "*")
            self.assertEqual((status, said["type"]), (422, "urn:panelgate:problem:invalid-configuration"))
            [fault] = said["problems"]
            row = wrong.split("\n")[fault["line"] - 1]
            self.assertTrue(row[fault["column"] - 1:].startswith("profil:"), fault)
            self.assertEqual((fault["severity"], running.file.read_text()), ("error", plant()))
            status, _, checked = ask(running.program, "POST", "/api/v1/configuration/check", wrong)
            self.assertEqual((status, checked["valid"], checked["problems"], checked["changes"]), (200, False, [fault], []))

    def test_a_check_tells_changes_interruptions_warnings_and_the_plan(self):
        meter = COMMENT + config.gateway(config.line(stations="{id: 1, name: meter}"), http=config.ADMIN)
        with Running(meter) as running:
            other = meter.replace("name: meter", "name: meter, poll: [{read: 400001, count: 1, every: 1s}]").replace("38400", "9600")
            checked = ask(running.program, "POST", "/api/v1/configuration/check", other)[2]
            self.assertTrue(checked["valid"], checked["problems"])
            self.assertIn({"path": "lines/floor1/serial/baud", "kind": "changed", "before": "38400", "after": "9600"},
                          [{key: value for key, value in one.items() if key != "needs"} for one in checked["changes"]])
            self.assertEqual([one["path"] for one in checked["interruptions"]], ["lines/floor1"])
            [line] = checked["plan"]["lines"]
            self.assertEqual([poll["station"] for poll in line["polls"]], ["meter"])
            warned = ask(running.program, "POST", "/api/v1/configuration/check", plant("{id: 9, name: odd}"))[2]["problems"]
            self.assertTrue(all(one["severity"] == "warning" for one in warned))
            self.assertEqual(running.file.read_text(), meter)

    def test_a_text_that_cannot_be_served_is_taken_back(self):
        with Running(plant()) as running, contextlib.closing(socket.create_server(("127.0.0.1", 0))) as other:
            taken = plant(modbus=f'listen: "127.0.0.1:{other.getsockname()[1]}"')
            status, _, said = ask(running.program, "PUT", TEXT, taken, "*")
            self.assertEqual((status, said["type"]), (409, "urn:panelgate:problem:reload-failed"), said)
            self.assertEqual(running.file.read_text(), plant())
            self.assertEqual(len(running.program.get("/api/v1/configuration/versions")[1]["versions"]), 1)

    def test_an_item_is_put_in_and_every_other_byte_stays(self):
        with Running(plant()) as running:
            body = json.dumps({"into": "lines/floor1/stations/press/points", "item": {"name": "heat", "at": "UW100", "scale": 0.1}})
            status, _, said = ask(running.program, "POST", "/api/v1/configuration/insert", body)
            self.assertEqual(status, 200, said)
            added = ", points: [{name: heat, at: UW100, scale: 0.1}]"
            self.assertEqual(said["text"].replace(added, ""), plant())
            self.assertIn(added, said["text"].split("\n")[said["line"] - 1])
            self.assertEqual(running.file.read_text(), plant())
            self.assertEqual(ask(running.program, "PUT", TEXT, said["text"], "*")[0], 200)


class Barred(unittest.TestCase):
    def test_a_file_under_git_is_changed_there(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "panelgate.yaml"
            file.write_text(plant())
            (file.parent / ".git").mkdir()
            with harness.Program("run", "-c", str(file)) as program:
                self.read_only(program, "under Git")
                self.assertEqual(file.read_text(), plant())

    @unittest.skipIf(os.geteuid() == 0, "root may write everywhere")
    def test_a_folder_that_cannot_be_written_says_so(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "panelgate.yaml"
            file.write_text(plant())
            file.parent.chmod(0o555)
            with harness.Program("run", "-c", str(file)) as program:
                self.read_only(program, "may not write")
            file.parent.chmod(0o755)

    def test_the_demo_is_no_file(self):
        with harness.demo() as program:
            status, _, text = ask(program, "GET", TEXT)
            self.assertEqual((status, text), (200, (harness.ROOT / "config/demo.yaml").read_text()))
            self.read_only(program, "built-in demo")

    def read_only(self, program, why):
        self.assertNotIn("PUT", ask(program, "GET", TEXT)[1]["Allow"])
        said = program.get("/api/v1/configuration")[1]["text"]
        self.assertEqual(said["writable"], False)
        self.assertIn(why, said["why"])
        status, headers, problem = ask(program, "PUT", TEXT, plant(MIXER), "*")
        self.assertEqual(status, 405)
        self.assertNotIn("PUT", headers["Allow"])
        self.assertIn(why, problem["detail"])
        self.assertTrue(ask(program, "POST", "/api/v1/configuration/check", plant(MIXER))[2]["valid"])


class Who(unittest.TestCase):
    """Rights, the audit and long texts."""

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        roles = {"eye": "viewer", "hand": "engineer", "chief": "admin", "starter": "reloads", "writer": "writes"}
        cls.text = plant(http=config.FREE_PORT + f", anonymous: none, tokens: {tokens(cls.folder, roles)}",
                         access="{roles: [{name: reloads, rights: [read, reload]}, {name: writes, rights: [read, configure]}]}",
                         audit=f"{{file: {cls.folder}/audit.jsonl}}")
        cls.running = cls.enterClassContext(Running(cls.text))

    def test_only_an_admin_and_a_role_with_the_right_see_and_change_it(self):
        program = self.running.program
        for token, status in ((None, 401), ("eye", 403), ("hand", 403), ("starter", 403), ("chief", 200), ("writer", 200)):
            for method, path, body in (("GET", TEXT, None), ("PUT", TEXT, self.text), ("POST", "/api/v1/configuration/check", self.text),
                                       ("GET", "/api/v1/configuration/versions", None), ("GET", "/api/v1/configuration/schema", None)):
                with self.subTest(token=token, method=method, path=path):
                    self.assertEqual(ask(program, method, path, body, "*", token)[0], status)
        self.assertNotIn("text", ask(program, "GET", "/api/v1/configuration", token="eye")[2])

    def test_each_call_is_in_the_audit(self):
        program = self.running.program
        for method, path, body in (("GET", TEXT, None), ("PUT", TEXT, self.text), ("PUT", TEXT, "lines: none"),
                                   ("POST", "/api/v1/configuration/check", self.text)):
            ask(program, method, path, body, "*", "writer")
        wanted = {("GET", 200), ("PUT", 200), ("PUT", 422), ("POST", 200)}
        deadline = time.monotonic() + harness.PATIENCE
        found = set()
        while not wanted <= found and time.monotonic() < deadline:
            lines = (self.folder / "audit.jsonl").read_text().splitlines()
            found = {(one["method"], one["status"]) for one in map(json.loads, lines)
                     if one.get("kind") == "configuration" and one.get("token") == "writer"}
        self.assertLessEqual(wanted, found)
        self.assertNotIn("hall 1", (self.folder / "audit.jsonl").read_text())

    def test_a_long_text_is_taken_of_who_may_send_one(self):
        program = self.running.program
        long = self.text + "# more\n" * 40_000
        self.assertEqual(ask(program, "POST", "/api/v1/configuration/check", long, token="chief")[2]["valid"], True)
        for token in ("hand", "wrong"):
            self.assertEqual(ask(program, "POST", "/api/v1/configuration/check", long, token=token)[0], 413)
        self.assertEqual(ask(program, "POST", "/api/v1/read", long, token="chief")[0], 413)


class Size(unittest.TestCase):
    def test_a_large_text_is_checked_beside_the_lines(self):
        """What takes long is done by a worker: clients of Modbus wait for none of it."""
        large = config.gateway(*config.wide_lines(60, 30, 4), modbus=None)
        with Running(plant()) as running, running.program.client() as client:
            took, waits, ended = [], [], threading.Event()

            def check():
                began = time.monotonic()
                found = ask(running.program, "POST", "/api/v1/configuration/check", large)[2]
                took.append((time.monotonic() - began, found["valid"]))
                ended.set()

            thread = threading.Thread(target=check)
            thread.start()
            while not ended.is_set():
                began = time.monotonic()
                client.ask(31, harness.read_registers(100))
                waits.append(time.monotonic() - began)
            thread.join()
            self.assertTrue(took[0][1])
            print(f"\n  {len(large)} bytes checked in {took[0][0]:.2f} s, longest wait {max(waits):.3f} s", end="")
            self.assertGreater(len(waits), 10)
            self.assertLess(max(waits), max(0.1, took[0][0] / 2))


if __name__ == "__main__":
    unittest.main()
