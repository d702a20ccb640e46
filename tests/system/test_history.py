"""The store: what happened and the values of days, over a restart; alarms over a restart, too."""
import contextlib
import csv
import http.server
import io
import json
import pathlib
import queue
import sqlite3
import ssl
import tempfile
import threading
import unittest
import urllib.request

import harness
from test_points import until

PRESS = "/api/v1/stations/press/"
VERSIONS = "/api/v1/configuration/versions"
ALARM = "/api/v1/alarms/press-hot/acknowledge"

CONFIG = """lines:
  - name: floor1
    device: sim
    serial: {{baud: 38400, parity: none}}
    stations:
      - id: 31
        name: press
        profile: autonics-gplp-s
        points:
          - {{name: setpoint, at: UW120, unit: celsius, writable: true, every: 100ms}}
http: {{listen: "127.0.0.1:0", anonymous: admin}}
store: {{file: {folder}/state.db}}
alarms:
  - {{name: press-hot, point: press/setpoint, above: 40, back: 30, severity: urgent, text: The press is too hot}}
  - {{name: press-lost, station: press, offline: true}}
"""


class History(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.file = self.folder / "panelgate.yaml"
        self.file.write_text(CONFIG.format(folder=folder.name))

    def run_gateway(self):
        return harness.Program("run", "--simulate", "-c", str(self.file))

    def set_point(self, program, value):
        self.assertEqual(program.rest("PUT", PRESS + "points/setpoint", {"value": value})[0], 200)

    def entries(self, program, query=""):
        status, body = program.get("/api/v1/journal" + query)
        self.assertEqual(status, 200, body)
        return body["entries"]

    def alarm(self, program):
        return program.get("/api/v1/alarms")[1]["alarms"][0]

    def test_a_write_is_an_entry_with_who_old_and_new_value_also_after_a_restart(self):
        with self.run_gateway() as program:
            self.set_point(program, 7)
            self.wait_for_samples(program)
            self.set_point(program, 9)
        with self.run_gateway() as program:
            writes = self.entries(program, "?kind=write")
            self.assertEqual([e["text"] for e in writes][0], "setpoint = 9, was 7 (confirmed)")
            self.assertEqual(writes[0]["who"], "http 127.0.0.1")
            self.assertEqual((writes[0]["line"], writes[0]["station"], writes[0]["point"]),
                             ("floor1", "press", "setpoint"))
            kinds = [e["kind"] for e in self.entries(program)]
            self.assertLess(kinds.index("start"), kinds.index("stop"))
            self.assertEqual(kinds.count("start"), 2)

    def wait_for_samples(self, program, greatest=None):
        """Until the store has a value (this greatest one); each turn is a request, which is answered by the store's thread."""
        for _ in range(2000):
            samples = program.get(PRESS + "points/setpoint/history?step=10s")[1]["samples"]
            if samples and greatest in (None, samples[-1]["max"]):
                return samples
        raise AssertionError("no sample came")

    def test_history_has_least_greatest_and_mean_also_after_a_restart(self):
        with self.run_gateway() as program:
            self.set_point(program, 900)  # above the 400 that a simulated panel begins with, in each run
            self.wait_for_samples(program, greatest=900)
        with self.run_gateway() as program:
            samples = program.get(PRESS + "points/setpoint/history?step=1d")[1]["samples"]
            self.assertEqual(samples[-1]["max"], 900)
            self.assertEqual(set(samples[-1]), {"time", "min", "max", "mean", "count"})
            for wrong in ("?step=7s", "?from=yesterday", "?from=2026-01-02T00:00:00Z&to=2026-01-01T00:00:00Z"):
                self.assertEqual(program.get(PRESS + "points/setpoint/history" + wrong)[0], 400, wrong)

    def test_an_alarm_is_raised_told_acknowledged_and_ends_over_restarts(self):
        with self.run_gateway() as program:
            self.assertEqual(program.rest("POST", ALARM)[0], 409, "it is normal")
            self.set_point(program, 50)
            program.log.wait_for("warn alarm alarm=press-hot state=active severity=urgent")
            self.assertIn('panelgate_alarm_active{alarm="press-hot",severity="urgent"} 1',
                          program.get("/metrics")[1])
        with self.run_gateway() as program:
            program.log.wait_for("station online|listening http")
            while self.alarm(program)["state"] == "normal":  # until the store has been read
                pass
            self.assertEqual(self.alarm(program)["state"], "active")
            status, alarm = program.rest("POST", ALARM)
            self.assertEqual((status, alarm["state"]), (200, "acknowledged"))
            self.assertEqual(alarm["acknowledged_by"], "http 127.0.0.1")
            self.assertEqual(program.rest("POST", ALARM)[0], 409)
            self.assertEqual(program.rest("POST", "/api/v1/alarms/none/acknowledge")[0], 404)
        with self.run_gateway() as program:
            self.set_point(program, 35)
            self.set_point(program, 20)
            program.log.wait_for("info alarm alarm=press-hot state=normal")
            kinds = [e["kind"] for e in reversed(self.entries(program))]
            told = [k for k in kinds if k.startswith("alarm")]
            self.assertEqual(told, ["alarm_raised", "alarm_acknowledged", "alarm_cleared"])

    def test_the_journal_as_csv_and_by_pages(self):
        with self.run_gateway() as program:
            for value in range(1, 6):
                self.set_point(program, value)
            request = urllib.request.Request(program.url("/api/v1/journal?kind=write"),
                                             headers={"Accept": "text/csv"})
            with urllib.request.urlopen(request, timeout=harness.PATIENCE) as answer:
                rows = list(csv.DictReader(io.StringIO(answer.read().decode())))
            self.assertEqual(len(rows), 5)
            self.assertEqual(rows[0]["kind"], "write")
            seen, after = [], 0
            while after is not None:
                page = program.get(f"/api/v1/journal?kind=write&limit=2&after={after}")[1]
                seen += [e["id"] for e in page["entries"]]
                after = page["next"]
            self.assertEqual(len(seen), 5)
            self.assertEqual(seen, sorted(seen, reverse=True))
            self.assertEqual(program.get("/api/v1/journal?kind=nothing")[0], 400)

    def test_a_write_to_all_stations_is_told_to_who_may_read_them_all(self):
        token = self.folder / "admin"
        token.write_text("token-of-an-admin-0123456789")
        token.chmod(0o600)
        text = self.file.read_text().replace("anonymous: admin", "anonymous: viewer, tokens: "
                                             f"[{{name: boss, role: admin, file: {token}}}]")
        text = text.replace("http:", "      - {id: 5, name: mixer, profile: autonics-gp-2005}\nhttp:", 1)
        self.file.write_text(text + "access: {rules: [{name: no-mixer, roles: [viewer], stations: [mixer], "
                                    "deny: [read]}]}\n")
        with self.run_gateway() as program:
            place = {"data": json.dumps({"table": "holding-registers", "address": 120, "values": [1]}).encode(),
                     "headers": {"Authorization": f"Bearer {token.read_text()}"}}
            urllib.request.urlopen(urllib.request.Request(
                program.url("/api/v1/lines/floor1/broadcast"), method="POST", **place), timeout=harness.PATIENCE).close()
            request = urllib.request.Request(program.url("/api/v1/journal?kind=write"), headers=place["headers"])
            with urllib.request.urlopen(request, timeout=harness.PATIENCE) as answer:
                self.assertEqual(len(json.loads(answer.read())["entries"]), 1)
            self.assertEqual(self.entries(program, "?kind=write"), [])
            self.assertTrue(self.entries(program, "?kind=line_up"))

    def test_a_kill_leaves_a_file_that_opens(self):
        with self.run_gateway() as program:
            self.set_point(program, 1)
            self.entries(program)  # the store's thread has written
            self.set_point(program, 2)
            program.process.kill()
            program.ends_with = -9
        with contextlib.closing(sqlite3.connect(self.folder / "state.db")) as database:
            self.assertEqual(database.execute("PRAGMA integrity_check").fetchone(), ("ok",))
        with self.run_gateway() as program:
            self.assertIn("setpoint = 1", self.entries(program, "?kind=write")[-1]["text"])

    def test_a_damaged_file_is_kept_and_told(self):
        (self.folder / "state.db").write_text("this is no database, but a text of some length\n" * 100)
        with self.run_gateway() as program:
            program.log.wait_for(r"warn store file .*state\.db\.damaged, and a new one begins")
            self.assertTrue(self.entries(program))
        self.assertTrue((self.folder / "state.db.damaged").exists())

    def test_a_file_that_cannot_be_made_is_told_and_the_line_goes_on(self):
        self.file.write_text(self.file.read_text().replace("/state.db", "/none/state.db"))
        with self.run_gateway() as program:
            program.log.wait_for("warn store fails .*unable to open database file")
            self.set_point(program, 3)
            self.assertEqual(program.get("/api/v1/journal")[0], 503)
            self.assertIn("panelgate_store_up 0", program.get("/metrics")[1])

    def test_a_webhook_is_told_of_the_alarm_and_of_its_end_also_where_it_was_away(self):
        with Alertmanager(answers=[500]) as hook:
            self.file.write_text(self.file.read_text() + f"alarm_webhook: {{url: {hook.url}, every: 1s}}\n")
            with self.run_gateway() as program:
                self.set_point(program, 20)
                self.set_point(program, 50)
                program.log.wait_for("warn webhook fails .*why=\"?500")
                program.log.wait_for("info webhook answers")
                self.assertEqual(hook.wait_for(lambda one: "endsAt" not in one)["labels"]["alertname"], "press-hot")
                self.set_point(program, 20)
                self.assertEqual(hook.wait_for(lambda one: "endsAt" in one)["annotations"]["summary"],
                                 "The press is too hot")

    def test_a_webhook_by_https_knows_the_server_by_the_ca(self):
        for names, well in ((("localhost", "127.0.0.1"), True), (("other.plant",), False)):
            with self.subTest(names=names), tempfile.TemporaryDirectory() as folder:
                for words in (["new-ca"], ["new-server", *names]):
                    self.assertEqual(harness.run("cert", *words, "--dir", folder).returncode, 0)
                secure = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
                secure.load_cert_chain(f"{folder}/{names[0]}.crt", f"{folder}/{names[0]}.key")
                with Alertmanager([], secure) as hook:
                    self.file.write_text(CONFIG.format(folder=folder) +
                                         f"alarm_webhook: {{url: {hook.url}, ca: {folder}/ca.crt, every: 1s}}\n")
                    with self.run_gateway() as program:
                        self.set_point(program, 20)
                        self.set_point(program, 50)
                        if well:
                            hook.wait_for(lambda one: one["labels"]["alertname"] == "press-hot")
                        else:
                            program.log.wait_for("warn webhook fails .*127.0.0.1")

    def test_texts_of_the_configuration_that_ran_outlive_a_restart(self):
        with self.run_gateway() as program:
            until(lambda: len(program.get(VERSIONS)[1]["versions"]) == 1)
            self.set_point(program, 1)
            until(lambda: self.entries(program, "?kind=write"))  # the store has answered
            self.file.write_text(self.file.read_text().replace("too hot", "much too hot"))
            self.assertEqual(program.rest("POST", "/api/v1/reload")[0], 200)
            until(lambda: len(program.get(VERSIONS)[1]["versions"]) == 2)
        with self.run_gateway() as program:
            until(lambda: len(program.get(VERSIONS)[1]["versions"]) == 2)
            newest = program.get(VERSIONS)[1]["versions"][0]
            self.assertEqual(newest["version"], 2)
            self.assertNotEqual(newest["who"], "start")
            self.assertEqual(program.rest("POST", "/api/v1/configuration/rollback", {"version": 1})[0], 200)
            self.assertNotIn("much", self.file.read_text())


class Alertmanager:
    """Takes alerts as Alertmanager does; `answers`: the first statuses, then 200. `secure`: TLS."""

    def __init__(self, answers, secure=None):
        self.alerts = queue.Queue()
        alerts = self.alerts

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_POST(self):
                body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
                status = answers.pop(0) if answers else 200
                if status == 200:
                    for one in body:
                        alerts.put(one)
                self.send_response(status)
                self.end_headers()

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        if secure:
            self.server.socket = secure.wrap_socket(self.server.socket, server_side=True)
        self.url = f"http{'s' if secure else ''}://127.0.0.1:{self.server.server_address[1]}/api/v2/alerts"
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.server.shutdown()
        self.server.server_close()

    def wait_for(self, wanted):
        while True:
            one = self.alerts.get(timeout=harness.PATIENCE)
            if wanted(one):
                return one


if __name__ == "__main__":
    unittest.main()
