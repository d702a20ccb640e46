"""status, top, trace and report of a running gateway; what is not well is named."""
import json
import os
import pathlib
import pty
import resource
import signal
import stat
import subprocess
import tempfile
import termios
import unittest

import config
import harness
import mqtt_side
from tls_plant import plant

REFUSED, USAGE, UNAVAILABLE, INTERNAL, BAD_CONFIGURATION = 1, 64, 69, 70, 78


class State(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.gateway = cls.enterClassContext(harness.demo())
        cls.http = f"127.0.0.1:{cls.gateway.http_port()}"
        cls.gateway.values("/api/v1/stations/press/devices/UW0")

    def ask(self, *arguments, **options):
        return harness.run(*arguments, "--http", self.http, **options)

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def test_a_panel_that_is_silent_is_not_well(self):
        well = self.ask("status")
        self.assertEqual((well.returncode, well.stderr), (0, ""), well.stdout)
        self.assertRegex(well.stdout, r"(?m)^LINE +STATE +LOAD")
        self.assertRegex(well.stdout, r"(?m)^floor1 +up +[\d.]+ % ")
        self.assertRegex(well.stdout, r"(?m)^press +floor1/31 +autonics-gplp-s +online +[\d.]+ s ago +[\d.]+ ms +0 of \d+$")
        self.assertTrue(well.stdout.endswith("\nall is well\n"))
        self.assertNotIn("\x1b", well.stdout)
        self.assertEqual(self.gateway.get("/api/v1/stations/mixer/devices/UW0")[0], 200)  # it has answered once
        self.gateway.rest("PUT", "/api/v1/simulator/mixer", {"dead": 1})
        try:
            for _ in range(4):
                self.gateway.get("/api/v1/stations/mixer/devices/UW0")
            told = self.ask("status")
            self.assertEqual(told.returncode, REFUSED, told.stdout)
            self.assertRegex(told.stdout, r"not all is well:\n  mixer is offline, its last answer is")
            listed = self.ask("status", "--format", "json")
            self.assertEqual(listed.returncode, REFUSED, listed.stdout)
            states = {each["name"]: each["state"] for each in json.loads(listed.stdout)["stations"]}
            self.assertEqual(states["mixer"], "offline")
            errors = self.ask("trace", "--errors", "--station", "mixer").stdout
            self.assertRegex(errors, r"(?m)^\S+Z +mixer +\w+ +timeout ")
            self.assertNotIn(" ok ", errors)
        finally:
            self.gateway.rest("PUT", "/api/v1/simulator/mixer", {"dead": 0})

    def on_a_terminal(self, *arguments, size=(24, 80), **env):
        """What a command draws, up to two screens or its end."""
        ours, theirs = pty.openpty()
        termios.tcsetwinsize(theirs, size)
        with os.fdopen(ours, "rb", buffering=0) as screen:
            process = subprocess.Popen([harness.PANELGATE, *arguments, "--http", self.http], stdout=theirs,
                                       stdin=subprocess.DEVNULL, env={**os.environ, "TERM": "xterm", **env})
            os.close(theirs)
            drawn = b""
            try:
                while drawn.count(b"Ctrl-C ends it.") < 2 and (more := screen.read(4096)):
                    drawn += more
            except OSError:  # its end
                pass
            process.send_signal(signal.SIGINT)
            return process.wait(harness.PATIENCE), drawn.decode()

    def test_colours_are_for_terminals_that_want_them(self):
        self.assertIn("\x1b[32monline\x1b[0m", self.on_a_terminal("status")[1])
        self.assertNotIn("\x1b", self.on_a_terminal("status", NO_COLOR="1")[1])
        self.assertNotIn("\x1b", self.on_a_terminal("status", TERM="dumb")[1])

    def test_top_draws_each_second_until_ctrl_c(self):
        code, drawn = self.on_a_terminal("top", NO_COLOR="1")
        self.assertEqual(code, 0, drawn)
        screens = drawn.split("\x1b[H\x1b[2J")[1:]
        self.assertRegex(screens[1], r"figures of the last (minute|[\d.]+ s)(.|\r|\n)*floor1 +up +[\d.]+ % .* [\d.]+ ms")

    def test_top_fits_the_terminal(self):
        screen = self.on_a_terminal("top", NO_COLOR="1", size=(12, 40))[1].split("\x1b[H\x1b[2J")[1]
        lines = screen.split("\r\n")
        self.assertEqual(len(lines), 12, screen)
        self.assertLessEqual(max(map(len, lines)), 40)
        self.assertRegex(lines[-2], r"^\(\d+ more lines\)$")
        self.assertNotIn("\x1b", self.on_a_terminal("top", TERM="dumb")[1])

    def test_top_looks_once_on_a_pipe(self):
        for arguments in (("top",), ("top", "--once")):
            looked = self.ask(*arguments)
            self.assertEqual(looked.returncode, 0, looked.stderr)
            for heading in ("LINE", "CLIENT", "SLOWEST"):
                self.assertRegex(looked.stdout, rf"(?m)^{heading} ")
            self.assertRegex(looked.stdout, r"(?m)^floor1 +up +[\d.]+ % +\[[# ]{16}\]")

    def test_a_trace_has_the_last_transactions(self):
        self.gateway.values("/api/v1/stations/press/devices/UW0")
        text = self.ask("trace", "--station", "floor1/31", "--count", "2").stdout
        lines = text.splitlines()
        self.assertTrue(lines[0].startswith("TIME "))
        self.assertLessEqual(len(lines), 3)
        self.assertRegex(lines[-1], r"^\d{4}-\d\d-\d\dT[\d:.]+Z press +(read|poll) +ok +[\d.]+ ms  .*> 1F .*  < 1F ")
        for typed, told in ((("--line", "flor1"), "did you mean 'floor1'?"),
                            (("--station", "presss"), "did you mean 'press'?")):
            ended = self.ask("trace", *typed)
            self.assertEqual((ended.returncode, ended.stdout), (REFUSED, ""))
            self.assertIn(told, ended.stderr)

    def test_a_trace_is_followed_until_a_signal(self):
        with harness.Program("trace", "--follow", "--count", "1", "--http", self.http) as following:
            following.out.wait_for("Z ", 3)
            self.assertEqual(following.stop(signal.SIGINT), 0)

    def test_a_trace_waits_for_a_gateway_that_is_started_anew(self):
        with harness.demo() as gateway:
            http = f"127.0.0.1:{gateway.http_port()}"
            with harness.Program("trace", "--follow", "--count", "1", "--http", http) as following:
                following.out.wait_for("Z ")
                self.assertEqual(gateway.stop(), 0)
                following.log.wait_for("no gateway answers at .*; waiting for it")
                with harness.Program("demo", "--http", http, "--modbus", "127.0.0.1:0") as anew:
                    anew.values("/api/v1/stations/oven/devices/GDT77")
                    following.out.wait_for("> 14 03 00 4D")
                    self.assertEqual(following.stop(signal.SIGINT), 0)

    def test_a_report_holds_all_that_there_is_and_writes_over_nothing(self):
        file = self.folder / "report.json"
        written = self.ask("report", "-o", str(file))
        self.assertEqual((written.returncode, written.stdout), (0, ""), written.stderr)
        self.assertIn(f"wrote {file}", written.stderr)
        self.assertEqual(stat.S_IMODE(file.stat().st_mode), 0o600)
        report = json.loads(file.read_text())
        self.assertLessEqual({"version", "configuration", "lines", "stations", "points", "relays", "findings", "usage", "history",
                              "trace", "metrics", "ready", "time"}, set(report))
        self.assertNotIn("missing", report)
        self.assertIn("findings", report["lines"]["floor1"])
        self.assertIn("panelgate_requests_total", report["metrics"])
        before = file.read_bytes()
        again = self.ask("report", "-o", str(file))
        self.assertEqual((again.returncode, again.stderr.count("\n")), (USAGE, 1))
        self.assertEqual(file.read_bytes(), before)
        self.assertEqual(self.ask("report", "-o", str(self.folder / "no/report.json")).returncode, INTERNAL)
        named = self.ask("report", cwd=self.folder)
        self.assertEqual(named.returncode, 0, named.stderr)
        self.assertEqual(len(list(self.folder.glob("panelgate-report-*Z.json"))), 1)

    def test_a_report_that_finds_no_room_is_an_error_and_leaves_no_part(self):
        def small():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
        file = self.folder / "report.json"
        told = self.ask("report", "-o", str(file), preexec_fn=small, restore_signals=False)
        self.assertEqual((told.returncode, file.exists()), (INTERNAL, False), told.stderr)
        self.assertIn(f"cannot write {file}: File too large", told.stderr)

    def test_names_are_printed_for_the_shell(self):
        self.assertEqual(self.ask("names").stdout.split(), ["press", "mixer", "io", "oven", "filler"])
        self.assertEqual(self.ask("names", "oven").stdout.split(), ["temperature", "mode"])
        self.assertEqual(self.ask("names", "nobody").stderr, "")


class Troubles(unittest.TestCase):
    """What is not well with the gateway itself, one after the other."""

    def test_each_is_a_finding_and_ends_status_with_1(self):
        with mqtt_side.Broker() as broker, plant() as made:
            made.cert("new-server", "127.0.0.1", "--days", "2", "--force")
            file = made.folder / "panelgate.yaml"
            text = config.gateway(
                config.line(), modbus=config.FREE_PORT + ", " + made.tls().replace("localhost.", "127.0.0.1."),
                http=config.ADMIN, audit=f"{{file: {made.folder}/none/audit.jsonl, on_failure: refuse_writes}}",
                mqtt=f"{{broker: 'mqtt://127.0.0.1:{broker.port}'}}")
            file.write_text(text)
            with harness.Program("run", "-c", str(file)) as program:
                at = ("--http", f"127.0.0.1:{program.http_port()}")
                program.log.wait_for("mqtt connected")
                broker.stop()
                file.write_text(text + "baudd: 7\n")
                self.assertEqual(harness.run("reload", *at).returncode, BAD_CONFIGURATION)
                program.log.wait_for("gateway finding .*cause=broker-away")
                told = harness.run("status", *at)
                self.assertEqual(told.returncode, REFUSED, told.stdout + told.stderr)
                for sentence in ("The MQTT broker mqtt://127.0.0.1:[0-9]+ is not connected", "The audit cannot be written "
                                 "to .*/none/audit.jsonl, so every write is refused", "The last reload was refused",
                                 "The certificate of modbus_tcp 127.0.0.1:[0-9]+ expires on .*, in [12] days"):
                    self.assertRegex(told.stdout, "not all is well:(.|\n)*\n  " + sentence)
                listed = program.get("/api/v1/findings")[1]
                self.assertEqual({one["cause"] for one in listed["findings"]},
                                 {"broker-away", "audit-fails", "reload-refused", "certificate-expires"})
                self.assertIn("unknown key 'baudd'", json.dumps(listed))
                for cause in ("broker-away", "audit-fails"):
                    self.assertRegex(program.get("/metrics")[1], rf'panelgate_findings{{cause="{cause}",name=".*"}} 1')
                made.cert("new-server", "127.0.0.1", "--force")
                (made.folder / "none").mkdir()
                broker.start()
                file.write_text(text)
                self.assertEqual(harness.run("reload", *at).returncode, 0)
                for cause in ("broker-away", "audit-fails", "certificate-expires", "reload-refused"):
                    program.log.wait_for(f"gateway finding gone cause={cause}")
                well = harness.run("status", *at)
                self.assertEqual((well.returncode, well.stdout[-12:]), (0, "all is well\n"), well.stdout)


class Secrets(unittest.TestCase):
    def test_a_report_has_neither_tokens_nor_passwords(self):
        with tempfile.TemporaryDirectory() as folder:
            token = pathlib.Path(folder) / "token"
            token.write_text("0123456789abcdef\n")
            token.chmod(0o600)
            http = f"{config.FREE_PORT}, anonymous: none, tokens: [{{name: ops, role: admin, file: {token}}}]"
            with harness.configured(config.gateway(config.line(), http=http)) as gateway:
                at = ("--http", f"127.0.0.1:{gateway.http_port()}")
                refused = harness.run("status", *at)
                self.assertEqual(refused.returncode, REFUSED)
                self.assertIn("--token-file", refused.stderr)
                made = harness.run("report", "-o", "-", *at, "--token-file", str(token))
                self.assertEqual(made.returncode, 0, made.stderr)
                self.assertNotIn("0123456789abcdef", made.stdout)
                self.assertIn("configuration", json.loads(made.stdout))

    def test_without_a_gateway_there_is_nothing_to_show(self):
        for command in ("status", "top", "trace", "report"):
            ended = harness.run(command, "--http", "127.0.0.1:9", cwd=os.path.dirname(harness.PANELGATE))
            self.assertEqual((ended.returncode, ended.stdout), (UNAVAILABLE, ""), command)
            self.assertIn("no gateway answers at http://127.0.0.1:9", ended.stderr)


if __name__ == "__main__":
    unittest.main()
