"""Another configuration for a program that runs: what is the same does not notice."""
import collections
import contextlib
import http.client
import json
import os
import pathlib
import signal
import struct
import subprocess
import tempfile
import threading
import unittest

import config
import harness
from harness import read_registers
from rtu_bus import Pieces, RtuBus
from test_points import until

ROUNDS = int(os.environ.get("PANELGATE_RELOADS", "40"))
METER = "{id: 1, name: meter, profile: omron-cp2e, points: [{name: level, at: D100, every: 50ms}]}"
STEADY = config.line("steady", stations=METER)
MIXER = "{id: 5, name: mixer, profile: autonics-gp-2005}"
IO = "{id: 17, name: io, profile: autonics-arm}"
OVEN = "{id: 20, name: oven, profile: panasonic-gt, poll: [{read: GDT0, count: 4, every: 50ms}]}"


def other(stations=MIXER, **keys):
    return config.line("other", stations=stations, **keys)


def connected(port):
    """A client, or None while nobody listens."""
    try:
        return harness.Client(port)
    except ConnectionRefusedError:
        return None


def plant(*lines, modbus=config.FREE_PORT, **keys):
    return config.gateway(STEADY, *lines, http=config.ADMIN, modbus=modbus, **keys)


class Running:
    """A program with a file that can be changed."""

    def __init__(self, text, *arguments):
        self.text = text
        self.arguments = arguments

    def __enter__(self):
        self._stack = contextlib.ExitStack()
        folder = pathlib.Path(self._stack.enter_context(tempfile.TemporaryDirectory()))
        self.file = folder / "panelgate.yaml"
        self.file.write_text(self.text)
        self.program = self._stack.enter_context(
            harness.Program("run", "-c", str(self.file), *self.arguments))
        self.program.http_port()
        return self

    def __exit__(self, *failure):
        return self._stack.__exit__(*failure)

    def reload(self, text=None, path="/api/v1/reload"):
        if text is not None:
            self.file.write_text(text)
        return self.program.rest("POST", path)

    def metric(self, name):
        with contextlib.closing(http.client.HTTPConnection(
                "127.0.0.1", self.program.http_port(), timeout=harness.PATIENCE)) as connection:
            connection.request("GET", "/metrics")
            text = connection.getresponse().read().decode()
        return [line.rsplit(" ", 1)[1] for line in text.splitlines() if line.startswith(name)]


class Reader(threading.Thread):
    """A client that asks a station of the steady line without pause, over one connection."""

    def __init__(self, port, unit=1):
        super().__init__(daemon=True)
        self.client = harness.Client(port)
        self.unit = unit
        self.good = 0
        self.bad = []
        self.ending = threading.Event()
        self.start()

    def run(self):
        try:
            while not self.ending.is_set():
                reply = self.client.ask(self.unit, read_registers(100, 2))
                if reply[:2] == bytes([3, 4]):
                    self.good += 1
                else:
                    self.bad.append(reply)
        except Exception as lost:  # told by end()
            self.bad.append(lost)

    def end(self):
        self.ending.set()
        self.join(harness.PATIENCE)
        return self.bad


class Reload(unittest.TestCase):
    def test_says_what_changes_and_serves_it(self):
        with Running(plant(other())) as running:
            self.assertEqual(running.program.get("/api/v1/reload"), (200, {"outcome": "none"}))
            status, verdict = running.reload()
            self.assertEqual((status, verdict["outcome"], verdict["changes"]),
                             (200, "unchanged", []))
            status, verdict = running.reload(plant(other(f"{MIXER}, {IO}")))
            self.assertEqual((status, verdict["outcome"]), (200, "applied"))
            self.assertEqual(verdict["changes"], ["lines/other/stations/io: added"])
            self.assertEqual(running.program.get("/api/v1/stations/io")[1]["id"], 17)
            client = harness.Client(running.program.modbus_port())
            self.assertEqual(client.ask(17, read_registers(0))[0], 3)
            self.assertEqual(running.program.get("/api/v1/reload")[1], verdict)

    def test_a_bad_file_changes_nothing_and_is_told_everywhere(self):
        with Running(plant(other())) as running:
            reader = Reader(running.program.modbus_port())
            status, problem = running.reload(plant(other("{id: 300, name: x, prifile: generic}")))
            self.assertEqual((status, problem["outcome"]), (422, "invalid"))
            self.assertEqual({error["line"] for error in problem["errors"]}, {9})
            self.assertTrue(any("prifile" in error["detail"] for error in problem["errors"]))
            self.assertEqual(running.program.get("/readyz")[0], 200)
            self.assertEqual(running.program.get("/api/v1/stations/mixer")[0], 200)
            self.assertEqual(running.metric('panelgate_config_reloads_total{outcome="invalid"}'),
                             ["1"])
            self.assertEqual(running.metric("panelgate_config_last_reload_successful"), ["0"])
            running.program.log.wait_for(r"error configuration error=.*panelgate.yaml:9:\d+: .*")
            self.assertEqual(reader.end(), [])
            running.file.unlink()
            self.assertEqual(running.reload()[0], 422)
            self.assertEqual(running.reload(plant(other()))[1]["outcome"], "unchanged")
            self.assertEqual(running.metric("panelgate_config_last_reload_successful"), ["1"])

    def test_a_pipe_whose_writer_is_idle_is_told_and_a_good_file_follows(self):
        with Running(plant(other())) as running:
            running.file.unlink()
            os.mkfifo(running.file)
            idle = os.open(running.file, os.O_RDWR)
            os.write(idle, b"lines:")
            problem = running.reload()[1]
            os.close(idle)
            self.assertEqual(problem["outcome"], "invalid")
            self.assertIn("its end did not come within 8 s", json.dumps(problem))
            running.file.unlink()
            self.assertEqual(running.reload(plant(other(IO)))[1]["outcome"], "applied")

    def test_lines_that_go_give_back_what_they_held(self):
        def named(number):
            return plant(config.line(f"far{number}", "tcp://127.0.0.1:1", "{id: 2}"),
                         config.line(f"near{number}", "/dev/nothing", "{id: 3}"),
                         config.line(f"played{number}", stations=IO))

        with Running(named(0)) as running:
            held = pathlib.Path(f"/proc/{running.program.process.pid}/fd")
            running.reload(named(1))  # all is open now
            first = len(list(held.iterdir()))
            for number in range(2, 7):
                self.assertEqual(running.reload(named(number))[1]["outcome"], "applied")
            until(lambda: running.program.get("/healthz") and len(list(held.iterdir())) <= first + 4)

    def test_the_way_back_leads_to_what_ran_before(self):
        with Running(plant(other())) as running:
            self.assertEqual(running.reload(path="/api/v1/reload?rollback=true")[0], 409)
            running.reload(plant(other(IO)))
            self.assertEqual(running.program.get("/api/v1/stations/mixer")[0], 404)
            status, verdict = running.reload(path="/api/v1/reload?rollback=true")
            self.assertEqual((status, verdict["outcome"], verdict["rollback"]),
                             (200, "applied", True))
            self.assertEqual(running.program.get("/api/v1/stations/mixer")[0], 200)
            self.assertEqual(running.program.get("/api/v1/stations/io")[0], 404)
            running.reload(plant(other(f"{MIXER}, {{id: 6, name: dryer, access: read_only}}")))
            self.assertEqual(running.program.get("/api/v1/stations/dryer")[0], 200)
            status, verdict = running.reload(path="/api/v1/reload?rollback=true")
            self.assertEqual((status, verdict["changes"]), (200, ["lines/other/stations/dryer: removed"]))

    def test_the_way_back_weakens_nothing_that_nobody_has_named(self):
        hard = "{id: 5, name: mixer, profile: autonics-gp-2005, access: read_only}"
        with Running(plant(other())) as running:
            self.assertEqual(running.reload(plant(other(hard)))[1]["outcome"], "applied")
            client = harness.Client(running.program.modbus_port())
            status, problem = running.reload(path="/api/v1/reload?rollback=true")
            self.assertEqual((status, problem["outcome"], problem["weaker"]),
                             (409, "refused", ["lines/other/stations/mixer: access read_only -> read_write"]))
            self.assertEqual(client.ask(5, bytes.fromhex("0600000001")), b"\x86\x01")
            self.assertEqual(running.metric("panelgate_config_last_reload_successful"), ["1"])
            self.assertEqual(running.reload(path="/api/v1/reload?weaker=true")[0], 400)
            place = f"127.0.0.1:{running.program.http_port()}"
            done = subprocess.run(
                [harness.PANELGATE, "reload", "--rollback", "--http", place],
                capture_output=True, text=True, timeout=harness.PATIENCE)
            self.assertEqual(done.returncode, 1)
            self.assertIn("  lines/other/stations/mixer: access read_only -> read_write", done.stderr)
            done = subprocess.run(
                [harness.PANELGATE, "reload", "--rollback", "--weaker", "--http", place],
                capture_output=True, text=True, timeout=harness.PATIENCE)
            self.assertEqual((done.returncode, done.stdout.split()[0]), (0, "applied"))
            running.program.log.wait_for("warn configuration weaker what=.lines/other/stations/mixer: access")

    def test_units_that_lead_to_another_panel_are_warned_of_as_check_does(self):
        def served(first, second):
            units = f", units: {{101: other/{first}, 102: other/{second}}}"
            return plant(other(f"{MIXER}, {IO}"), modbus=config.FREE_PORT + units)

        def moved(lines):
            return [line[line.index("unit "):] for line in lines if "unit 10" in line]
        with Running(served("mixer", "io")) as running:
            old = running.file.with_name("old.yaml")
            old.write_text(served("mixer", "io"))
            status, verdict = running.reload(served("io", "mixer"))
            self.assertEqual((status, verdict["outcome"]), (200, "applied"))
            told = moved(verdict["warnings"])
            self.assertEqual(len(told), 2, verdict["warnings"])
            self.assertIn("unit 101 of 127.0.0.1:0 was 'mixer' of line other and is now 'io' of "
                          "line other: a write to it may reach another panel; ", told[0])
            checked = harness.run("check", "-c", str(running.file), "--diff", str(old))
            self.assertEqual(moved(checked.stderr.splitlines()), told)
            running.program.log.wait_for(
                "warn configuration warning=.unit 102 of 127.0.0.1:0 was .io. of line other")
            self.assertEqual(moved(running.reload()[1]["warnings"]), [])
            running.file.write_text(served("mixer", "io"))
            running.program.process.send_signal(signal.SIGHUP)
            running.program.log.wait_for(
                "warn configuration warning=.unit 102 of 127.0.0.1:0 was .mixer. of line other")

    def test_by_signal_and_by_a_file_that_is_replaced(self):
        with Running(plant(other()), "--watch") as running:
            running.file.write_text(plant(other(f"{MIXER}, {IO}")))
            running.program.process.send_signal(signal.SIGHUP)
            running.program.log.wait_for(r"reload outcome=applied cause=SIGHUP")
            new = running.file.with_suffix(".new")
            new.write_text(plant(other(f"{MIXER}, {IO}, {OVEN}")))
            new.replace(running.file)
            running.program.log.wait_for(r'reload outcome=applied cause="the file has changed"')
            self.assertEqual(running.program.get("/api/v1/stations/oven")[0], 200)

    def test_a_points_file_that_is_replaced(self):
        with tempfile.TemporaryDirectory() as folder:
            points = pathlib.Path(folder) / "press.csv"
            points.write_text("name,at\nfirst,400001\n")
            listed = f"{{id: 6, name: press, points_file: {points}}}"
            with Running(plant(other(listed)), "--watch") as running:
                self.assertEqual(running.program.get("/api/v1/stations/press/points/first")[0], 200)
                new = points.with_suffix(".new")
                new.write_text("name,at\nfirst,400001\nsecond,400002\n")
                new.replace(points)
                running.program.log.wait_for(r'reload outcome=applied cause="the file has changed"')
                self.assertEqual(running.program.get("/api/v1/stations/press/points/second")[0], 200)
                new.write_text("name,at\nfirst,nowhere\n")
                new.replace(points)
                running.program.log.wait_for("reload outcome=invalid")
                self.assertEqual(running.program.get("/api/v1/stations/press/points/second")[0], 200, "as before")

    def test_a_points_file_that_changes_just_after_the_reload_that_names_it(self):
        with tempfile.TemporaryDirectory() as folder:
            points = pathlib.Path(folder) / "press.csv"
            points.write_text("name,at\nfirst,400001\n")
            with Running(plant(other()), "--watch") as running:
                listed = f"{{id: 6, name: press, points_file: {points}}}"
                self.assertEqual(running.reload(plant(other(listed)))[1]["outcome"], "applied")
                points.write_text("name,at\nfirst,400001\nsecond,400002\n")
                until(lambda: running.program.get("/api/v1/stations/press/points/second")[0] == 200)

    def test_listeners_come_and_go_and_clients_of_others_stay(self):
        with Running(plant(other())) as running:
            first = harness.Client(running.program.modbus_port())
            self.assertEqual(first.ask(1, read_registers(100))[0], 3)
            text = plant(other(), modbus=config.FREE_PORT + '}, {listen: "127.0.0.2:0", '
                                                            'access: read_only')
            self.assertEqual(running.reload(text)[1]["outcome"], "applied")
            second = harness.Client(running.program.modbus_port(2), host="127.0.0.2")
            self.assertEqual(second.ask(1, read_registers(100))[0], 3)
            self.assertEqual(second.ask(1, harness.write_register(100, 1))[0], 0x86)
            self.assertEqual(running.reload(plant(other()))[1]["outcome"], "applied")
            with self.assertRaises(harness.Closed):
                second.ask(1, read_registers(100))
            self.assertEqual(first.ask(1, read_registers(100))[0], 3)
            text = plant(other(), modbus=config.FREE_PORT + ", access: read_only")
            self.assertEqual(running.reload(text)[1]["outcome"], "applied")
            self.assertEqual(first.ask(1, harness.write_register(100, 1))[0], 0x86,
                             "the same connection, by the new rules")
            text = plant(other(), modbus=config.FREE_PORT + ", allow: [192.0.2.0/24]")
            running.reload(text)
            with self.assertRaises(harness.Closed):
                first.ask(1, read_registers(100))

    def test_a_port_that_somebody_has_is_no_reload(self):
        with Running(plant(other())) as running, harness.Helper(
                ["python3", "-c", "import socket; s = socket.create_server(('127.0.0.1', 0));"
                                  "print(s.getsockname()[1], flush=True); input()"]) as somebody:
            port = int(somebody.out.wait_for(r"^(\d+)$").group(1))
            text = plant(other(IO), modbus=f'listen: "127.0.0.1:{port}"')
            status, problem = running.reload(text)
            self.assertEqual((status, problem["outcome"]), (409, "failed"))
            self.assertIn("another program listens there", problem["detail"])
            self.assertEqual(running.program.get("/api/v1/stations/mixer")[0], 200)
            client = harness.Client(running.program.modbus_port())
            self.assertEqual(client.ask(5, read_registers(0))[0], 3)

    def test_points_that_are_the_same_keep_their_values_and_their_past(self):
        slow = METER.replace("every: 50ms", "every: 60min")
        before = config.gateway(config.line("steady", stations=slow), http=config.ADMIN)
        more = slow.replace("}]}", "}, {name: more, at: D200, every: 50ms}]}")
        after = config.gateway(config.line("steady", stations=more), http=config.ADMIN)
        path = "/api/v1/stations/meter/points/"
        with Running(before) as running:
            until(lambda: running.program.get(path + "level")[1]["quality"] == "good")
            age = running.program.get(path + "level")[1]["age_ms"]
            self.assertEqual(running.reload(after)[1]["changes"],
                             ["lines/steady/stations/meter/points/more: added"])
            level = running.program.get(path + "level")[1]
            self.assertEqual(level["quality"], "good")
            self.assertGreaterEqual(level["age_ms"], age)
            self.assertEqual(len(running.program.get(path + "level/history")[1]["samples"]), 1)
            until(lambda: running.program.get(path + "more")[1]["quality"] == "good")

    def test_the_command_says_what_came_of_it(self):
        with Running(plant(other())) as running:
            door = f"127.0.0.1:{running.program.http_port()}"

            def command(*more):
                done = subprocess.run([harness.PANELGATE, "reload", "--http", door, *more],
                                      capture_output=True, text=True, timeout=harness.PATIENCE)
                return done.returncode, done.stdout, done.stderr
            self.assertEqual(command()[:2], (0, "unchanged\n"))
            running.file.write_text(plant(other(IO)))
            code, out, _ = command()
            self.assertEqual(code, 0)
            self.assertIn("  lines/other/stations/mixer: removed\n", out)
            running.file.write_text("lines: 7\n")
            code, out, told = command()
            self.assertEqual((code, out), (78, ""))
            self.assertRegex(told, r"panelgate.yaml:1:8: .*")
            self.assertEqual(command("--rollback")[0], 0)
            self.assertEqual(running.program.get("/api/v1/stations/mixer")[0], 200)

    def with_tokens(self, folder, before, after):
        """A gateway whose token's file has another content since, and how `reload` ends with that."""
        token = folder / "ops"
        token.write_text(before)
        token.chmod(0o600)
        http = f"{config.FREE_PORT}, anonymous: none, tokens: [{{name: ops, role: admin, file: {token}}}]"
        running = self.enterContext(Running(config.gateway(STEADY, http=http)))
        token.write_text(after)
        place = f"127.0.0.1:{running.program.http_port()}"

        def command(*more):
            return subprocess.run([harness.PANELGATE, "reload", "--http", place, "--token-file", str(token), *more],
                                  capture_output=True, text=True, timeout=harness.PATIENCE, check=False)
        return running, command

    def test_a_new_token_in_its_file_locks_nobody_out(self):
        folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        running, command = self.with_tokens(folder, "the-token-of-before-1", "the-token-that-is-new")
        rolled = command("--rollback")  # a signal could not say that
        self.assertEqual((rolled.returncode, rolled.stdout), (1, ""))
        self.assertIn("reload first", rolled.stderr)
        self.assertNotIn("cause=SIGHUP", running.program.log.text())
        done = command()
        self.assertEqual((done.returncode, done.stdout),
                         (0, "applied\n  http/tokens/ops: secret changed\n"), done.stderr)
        self.assertIn("asked by SIGHUP, process ", done.stderr)
        self.assertNotIn("that-is-new", done.stderr)
        again = command()
        self.assertEqual((again.returncode, again.stdout), (0, "unchanged\n"))
        self.assertNotIn("SIGHUP", again.stderr)

    def test_a_token_that_stays_unknown_is_told(self):
        folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        running, command = self.with_tokens(folder, "the-token-of-before-1", "the-token-that-is-new")
        running.file.write_text("lines: 7\n")  # so the new token is never known
        done = command()
        self.assertEqual((done.returncode, done.stdout), (75, ""))
        self.assertIn("its log says", done.stderr)
        running.program.log.wait_for("reload outcome=invalid cause=SIGHUP")

    def test_p1_a_device_under_another_name_gives_nobody_the_reply_of_before(self):
        def panel(frame):  # slow at one place, or it says which place it was asked for
            address = struct.unpack(">H", frame[2:4])[0]
            reply = harness.rtu(1, struct.pack(">BBH", 3, 2, address))
            return Pieces([(0.35 if address == 10 else 0.0, reply)])

        def line(name, link):
            return config.gateway(
                config.line(name, link, "{id: 1}", retries=0, echo="off",
                            timing="{response_timeout: 200ms, late_window: 5s}"),
                http=config.ADMIN)
        with tempfile.TemporaryDirectory() as folder:
            link = pathlib.Path(folder) / "tty"
            with RtuBus(link, {1: panel}), Running(line("one", link)) as running:
                client = harness.Client(running.program.modbus_port())
                running.program.log.wait_for("line up")
                until(lambda: client.ask(1, read_registers(10)) == b"\x83\x0b")
                self.assertEqual(running.reload(line("other", link))[1]["outcome"], "applied")
                for address in range(50, 60):
                    reply = client.ask(1, read_registers(address))
                    if reply[0] == 3:  # or that the panel is away, or slow on a busy machine
                        self.assertEqual(reply, struct.pack(">BBH", 3, 2, address))

    def test_points_of_another_device_are_not_those_of_before(self):
        slow = METER.replace("every: 50ms", "every: 60min")

        def text(device):
            return config.gateway(config.line("steady", device, slow), http=config.ADMIN)
        path = "/api/v1/stations/meter/points/level"
        with Running(text("sim")) as running:
            until(lambda: running.program.get(path)[1]["quality"] == "good")
            running.reload(text("/dev/there-is-none"))
            self.assertEqual(running.program.get(path)[1]["quality"], "bad")

    def test_a_listener_may_be_opened_for_more_and_for_fewer_on_its_port(self):
        with Running(plant(other())) as running:
            port = running.program.modbus_port()  # free again when this one is moved
            for host in ("0.0.0.0", "127.0.0.1", "0.0.0.0"):
                running.reload(plant(other(), modbus=f'listen: "127.0.0.2:{port}"'))
                text = plant(other(), modbus=f'listen: "{host}:{port}"')
                self.assertEqual(running.reload(text)[1]["outcome"], "applied", host)
                client = until(lambda: connected(port))  # the port is opened once the former listener has left it
                self.assertEqual(client.ask(1, read_registers(100))[0], 3)
                text = plant(other(IO), modbus=f'listen: "{host}:{port}"')
                self.assertEqual(running.reload(text)[1]["outcome"], "applied", host)

    def test_what_is_asked_for_in_a_body_is_heeded(self):
        with Running(plant(other())) as running:
            running.reload(plant(other(IO)))
            for body, status in (({"rolback": True}, 400), ({"rollback": 1}, 400),
                                 ({"rollback": True}, 200)):
                self.assertEqual(running.program.rest("POST", "/api/v1/reload", body)[0], status)
            self.assertEqual(running.program.get("/api/v1/stations/mixer")[0], 200)

    def test_p1_p3_two_hundred_reloads_and_nobody_on_an_unchanged_line_notices(self):
        """PANELGATE_RELOADS of them; the full count is for the bench."""
        away = plant()
        variants = [
            plant(other(f"{MIXER}, {IO}")), plant(other(f"{MIXER}, {OVEN}")),
            plant(other(timing="{response_timeout: 300ms}")), plant(other(echo="off")),
            plant(other(retries=2, queue="{limit: 64}")), away, plant(other()),
            plant(other(), config.line("third", stations=IO)),
            plant(other(), modbus=config.FREE_PORT + ", max_connections: 100"),
        ]
        with Running(plant(other())) as running:
            port = running.program.modbus_port()
            readers = [Reader(port) for _ in range(3)]
            changed = Reader(port, unit=5)
            events = http.client.HTTPConnection("127.0.0.1", running.program.http_port(),
                                                timeout=harness.PATIENCE)
            events.request("GET", "/api/v1/events?types=point&station=meter")
            stream = events.getresponse()
            for turn in range(ROUNDS):
                before = [reader.good for reader in readers]
                status, verdict = running.reload(variants[turn % len(variants)])
                self.assertEqual((status, verdict["outcome"]), (200, "applied"), verdict)
                until(lambda: all(r.good > n or r.bad for r, n in zip(readers, before)))
                self.assertEqual(
                    running.program.get("/api/v1/stations/meter/points/level")[1]["quality"],
                    "good")
            for reader in readers:
                self.assertEqual(reader.end(), [])
            # P1, P3: on the line that changes, each is answered: by its panel, or that it is away.
            for reply in changed.end():
                self.assertIsInstance(reply, bytes, reply)
                self.assertIn((reply[0], reply[1]), [(0x83, 0x0A), (0x83, 0x0B), (0x83, 0x06)])
            line = stream.readline()  # what it was sent meanwhile, and is still being sent
            self.assertTrue(line)
            events.close()
            lag = [float(value) for value in running.metric("panelgate_loop_lag_seconds_bucket")]
            print(json.dumps({"reloads": ROUNDS, "answers": sum(r.good for r in readers),
                              "changed_good": changed.good,
                              "changed_bad": dict(collections.Counter(map(str, changed.bad))),
                              "loop_lag_buckets": lag}))
            self.assertGreater(changed.good, 0)


if __name__ == "__main__":
    unittest.main()
