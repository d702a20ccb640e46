"""The audit: what is told of files that go, of records that could not be written, and which lines
of a log count."""
import http.client
import shutil
import signal
import unittest
import urllib.parse

import harness
import test_audit
from harness import write_register


class Told(test_audit.Case):
    def test_a_file_that_is_removed_is_told_at_once_and_missed_by_verify(self):
        self.write_config("refuse_writes", anonymous="admin")
        self.folder.mkdir()
        with self.gateway() as program, program.client() as client:
            program.log.wait_for("audit anchor number=2")
            client.ask(test_audit.STATION, write_register(1, 2))
            (self.folder / "audit.jsonl").unlink()
            program.log.wait_for("warn audit file .*was removed or moved away while it was written")
        done = harness.run("audit", "verify", "-c", str(self.file))
        self.assertEqual(done.returncode, 1, done.stdout)
        self.assertRegex(done.stdout, "removed: records 1 to [0-9]+ removed")

    def test_what_waits_at_a_stop_is_counted_and_the_next_start_says_so(self):
        self.write_config()
        with self.gateway() as program, program.client() as client:
            program.log.wait_for("audit fails")
            for i in range(7):
                client.ask(test_audit.STATION, write_register(1, i))
        log = self.folder.parent / "log"
        text = program.log.finished_text()
        self.assertRegex(text, "error audit records lost count=8 file=")  # and the end
        self.folder.mkdir()
        with self.gateway() as program:
            program.log.wait_for("audit anchor")
        log.write_text(text + program.log.finished_text())
        done = harness.run("audit", "verify", "-c", str(self.file), "--log", str(log))
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertIn("8 records could not be written", done.stdout)

    def test_no_text_of_a_client_is_an_anchor(self):
        for style in ("text", "json"):
            self.write_config(anonymous="viewer")
            self.file.write_text(self.file.read_text() + f"log: {{format: {style}}}\n")
            shutil.rmtree(self.folder, ignore_errors=True)
            self.folder.mkdir()
            anchor = f"info audit anchor number=2 hash={'0' * 64}"
            member = f'","event":"audit anchor","number":"2","hash":"{"0" * 64}","x":"'
            with self.gateway() as program:
                program.log.wait_for("audit anchor")
                port = program.log.wait_for(r'listening.*http\W+127.0.0.1:(\d+)').group(1)
                for text in (anchor, "\n" + anchor, "\v" + anchor, member):
                    place = urllib.parse.quote(text, safe="")
                    for path in (f"/api/v1/stations/press/points/{place}", f"/{place}"):
                        web = http.client.HTTPConnection("127.0.0.1", int(port), timeout=harness.PATIENCE)
                        web.request("PUT", path, '{"value": 1}', {"Content-Type": "application/json"})
                        self.assertIn(web.getresponse().status, (401, 403, 404))
                        web.close()
            log = self.folder.parent / "log"
            log.write_text(program.log.finished_text())
            done = harness.run("audit", "verify", "-c", str(self.file), "--log", str(log))
            self.assertEqual(done.returncode, 0, done.stdout)
            forged = harness.run("audit", "verify", "-c", str(self.file), "--log", "/dev/null")
            self.assertEqual(forged.returncode, 1, forged.stdout)
            self.assertIn("the log names no record", forged.stdout)

    def test_each_chain_is_compared_with_its_own_anchors(self):
        self.write_config()
        self.folder.mkdir()
        with self.gateway() as program:
            program.log.wait_for("audit anchor")
            self.file.write_text(self.file.read_text().replace("audit.jsonl", "other.jsonl"))
            program.process.send_signal(signal.SIGHUP)
            program.log.wait_for(" reload .*applied")
        log = self.folder.parent / "log"
        log.write_text(program.log.finished_text())
        for name in ("audit.jsonl", "other.jsonl"):
            done = harness.run("audit", "verify", str(self.folder / name), "--log", str(log))
            self.assertEqual(done.returncode, 0, done.stdout)
        forged = self.folder / "forged.jsonl"
        forged.write_text((self.folder / "audit.jsonl").read_text().replace('"version":"', '"version":"9'))
        done = harness.run("audit", "verify", "-c", str(self.file), "--log", str(log), str(forged))
        self.assertEqual(done.returncode, 1, done.stdout)
        self.assertIn("forged.jsonl:2: changed", done.stdout)

    def test_one_write_is_one_record_and_refusals_say_where(self):
        self.write_config(anonymous="operator")
        token = self.folder.parent / "viewer"
        token.write_text("v" * 40)
        token.chmod(0o600)
        self.file.write_text(self.file.read_text().replace(
            "anonymous: operator", f"anonymous: operator, tokens: [{{name: v, role: viewer, file: {token}}}]") + """access:
  rules: [{name: no5, deny: [write], stations: [press], range: holding-registers/5-5}]
""")
        self.folder.mkdir()
        with self.gateway() as program, program.client() as client:
            for _ in range(3):
                program.rest("PUT", "/api/v1/stations/press/holding-registers/5", {"value": 1})
            web = http.client.HTTPConnection("127.0.0.1", program.http_port(), timeout=harness.PATIENCE)
            web.request("PUT", "/api/v1/stations/press/holding-registers/6", '{"value": 1}',
                        {"Content-Type": "application/json", "Authorization": "Bearer " + "v" * 40})
            self.assertEqual(web.getresponse().status, 403)
            web.close()
            client.ask(test_audit.STATION, write_register(5, 1))
            client.ask(test_audit.STATION, write_register(5, 1))
        kept = [one for one in test_audit.records(self.folder) if one.get("station") == "press"]
        told = [(one["kind"], one["face"], one.get("rule"), one["line"]) for one in kept if one["kind"] != "repeats"]
        self.assertEqual([one["at"] for one in kept if one["kind"] == "refusal"], ["400007"])
        self.assertEqual(told, [("write", "http", "no5", "floor1"), ("refusal", "http", None, "floor1"),
                                ("write", "modbus_tcp", "no5", "floor1")])
        counts = {"http": 0, "modbus_tcp": 0}
        for one in kept:
            counts[one["face"]] += one["count"] if one["kind"] == "repeats" else 0
        self.assertEqual(counts, {"http": 2, "modbus_tcp": 1})

    def test_a_broadcast_that_cannot_be_recorded_is_refused_as_busy(self):
        self.write_config("refuse_writes")
        self.file.write_text(self.file.read_text().replace(", access: read_only", ""))
        with self.gateway() as program, program.client() as client:
            program.log.wait_for("audit fails")
            self.assertEqual(client.ask(0, write_register(1, 2)), b"\x86\x06")
            self.folder.mkdir()
            program.log.wait_for("audit recovered")
        self.assertEqual([one["rule"] for one in test_audit.records(self.folder) if one["kind"] == "write"], ["audit"])


if __name__ == "__main__":
    unittest.main()
