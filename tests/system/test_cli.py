"""The command line: exit codes, and what a person reads when something is wrong."""
import json
import os
import pathlib
import re
import socket
import subprocess
import tempfile
import unittest

import config
import harness
from harness import ROOT, run

USAGE, NO_INPUT, UNAVAILABLE, BAD_CONFIG = 64, 66, 69, 78


def good(modbus_port=0, http_port=0):
    return config.gateway(config.line(), modbus=f"listen: 127.0.0.1:{modbus_port}",
                          http=f"listen: 127.0.0.1:{http_port}")


class CommandLine(unittest.TestCase):
    def expect(self, code, *arguments):
        ended = run(*arguments)
        self.assertEqual(ended.returncode, code, ended.stdout + ended.stderr)
        return ended

    def test_version_and_help_end_with_0(self):
        self.assertRegex(self.expect(0, "--version").stdout, r"^panelgate \d+\.\d+\.\d+\n"
                         r"commit \w+, \w+ \d.*\nboost 1\.\d+\.\d+, .*yaml-cpp \d.*\n$")
        text = self.expect(0, "--help").stdout
        for group in ("Begin", "Run", "Ask a running gateway", "Configuration", "Tools", "Examples"):
            self.assertIn(f"\n{group}:\n", text)
        for command in ("run", "demo", "check", "simulate", "address", "profiles",
                        "health", "schema", "import", "init", "scan", "config"):
            self.assertRegex(text, rf"(?m)^\s+{command}\b")
            self.assertIn("Usage", self.expect(0, command, "--help").stdout)

    def test_each_help_has_an_example_and_fits_a_terminal(self):
        listed = self.expect(0, "help").stdout.split("\nExamples:")[0].split("\nBegin:")[1]
        commands = [[name] for name in re.findall(r"(?m)^  (\w+)", listed) if name not in ("help", "version")]
        self.assertGreater(len(commands), 18)
        for command in [[], *commands, ["config", "get"], ["config", "keys"],
                        *(["cert", name] for name in ("new-ca", "new-server", "new-client", "revoke"))]:
            text = self.expect(0, *command, "--help").stdout
            self.assertLessEqual(max(map(len, text.splitlines())), 80, text)
            self.assertRegex(text, rf"\nExamples?:\n  panelgate {' '.join(command)}")

    def test_an_empty_value_of_an_option_is_refused(self):
        for words in (["scan", "/dev/null", "--stations", ""], ["status", "--http", ""],
                      ["init", "/dev/null", "-o", ""], ["report", "-o", ""], ["run", "--config="]):
            told = self.expect(USAGE, *words).stderr
            self.assertRegex(told, "a value is missing after it|needs a value after it")
            self.assertEqual(told.count("\n"), 1)

    def test_wrong_usage_ends_with_64_and_says_why(self):
        for arguments in ([], ["fly"], ["run", "--fly"], ["check", "--format", "xml"], ["address"],
                          ["health", "--http", "nowhere"], ["health", "--http", "127.0.0.1:0"],
                          ["health", "now"], ["schema", "now"], ["import"], ["init"],
                          ["init", "sim"], ["init", "/dev/ttyS0", "--baud", "fast"],
                          ["init", "/dev/null", "-o", str(ROOT / "README.md")], ["address", "autonics-gplp-s"], ["demo", "--http", "nowhere"],
                          ["profiles", "autonics-gplp"], ["address", "nobody", "UB1"],
                          ["address", "autonics-gplp-s", "XY12"]):
            with self.subTest(arguments=arguments):
                self.assertNotEqual(self.expect(USAGE, *arguments).stderr.strip(), "")

    def test_a_setting_is_looked_up_with_its_default(self):
        example = str(ROOT / "config/panelgate.example.yaml")
        get = lambda *path: self.expect(0, "config", "get", *path, "-c", example).stdout
        self.assertEqual(get("lines.floor1.stations.press.retries"), "1\n")
        self.assertEqual(get("lines/floor1/timing/broadcast_turnaround"), "100ms\n")
        press = get("lines.floor1.stations.press")
        self.assertIn("lines.floor1.stations.press.crc_order: low_first\n", press)
        self.assertNotIn("stations.oven", press)
        self.assertIn(press, get())
        for path in ("lines.floor1.retires", "nothing"):
            self.assertIn("there is no setting", self.expect(USAGE, "config", "get", path, "-c", example).stderr)
        self.assertIn("did you mean 'lines.floor1.retries'",
                      self.expect(USAGE, "config", "get", "lines.floor1.retires", "-c", example).stderr)
        self.assertIn("config does not take 'gte'; did you mean 'get'?", self.expect(USAGE, "config", "gte").stderr)
        self.assertIn("is changed in the file, with an editor",
                      self.expect(USAGE, "config", "set", "lines.floor1.retries", "3", "--dry-run").stderr)

    def test_the_keys_of_a_configuration_are_explained(self):
        keys = lambda *path: self.expect(0, "config", "keys", *path).stdout
        self.assertIn("lines.queue.limit: 1 to 4096 (default 256)\n    Most requests that wait, of all clients together.\n",
                      keys("lines.queue"))
        self.assertIn("lines.timing.frame_gap: 0ms to 10s, or auto (default auto)\n", keys("lines.timing"))
        self.assertIn("lines.stations.id: 1 to 255 (required)\n", keys())
        self.assertIn("there is no key", self.expect(USAGE, "config", "keys", "nothing").stderr)
        self.assertIn("did you mean 'lines'?", self.expect(USAGE, "config", "keys", "linse").stderr)

    def test_a_mistyped_command_is_told_the_nearest(self):
        for typed, near in (("chekc", "check"), ("simulat", "simulate"), ("dmeo", "demo")):
            told = self.expect(USAGE, typed, "-c", "x.yaml").stderr
            self.assertIn(f"there is no command '{typed}'; did you mean '{near}'?", told)
        self.assertIn("Commands: demo scan init run", self.expect(USAGE, "fly").stderr)
        told = self.expect(USAGE).stderr
        for word in ("a command is missing", "To begin:", "panelgate demo", "panelgate init", "panelgate run"):
            self.assertIn(word, told)

    def test_a_mistyped_option_is_told_the_nearest(self):
        for typed, near in (("--confg", "--config"), ("--formt=json", "--format"), ("-C", "-c")):
            told = self.expect(USAGE, "check", typed, "x.yaml").stderr
            self.assertIn(f"check has no option '{typed.partition('=')[0]}'; did you mean "
                          f"'{near}'?", told)
        self.assertIn("a file is given with -c: check -c x.yaml",
                      self.expect(USAGE, "check", "x.yaml").stderr)
        self.assertNotIn("-c", self.expect(USAGE, "status", "extra").stderr)
        self.assertIn("did you mean '--version'?", self.expect(USAGE, "--verison").stderr)
        self.assertIn("a command is missing before '-c'", self.expect(USAGE, "-c", "x").stderr)

    def test_what_a_command_lacks_is_told_by_name(self):
        for typed, told in (("check --format xml", "--format must be text or json, not 'xml'"),
                            ("check --format", "--format needs a value after it"),
                            ("check -c a -c b", "--config may be given once"),
                            ("reload --weaker", "--weaker requires --rollback"),
                            ("address autonics-gplp-s", "NOTATION is missing"),
                            ("run --simulate=x", "an option that takes no value was given one"),
                            ("config get log --format json", "there is no option --format here"),
                            ("run -- x", "nothing may follow '--'")):
            command = typed.split()[0]
            self.assertEqual(self.expect(USAGE, *typed.split()).stderr,
                             f"panelgate: {command}: {told}; `panelgate help {command}` says what "
                             "it takes\n")

    def test_without_a_device_the_adapters_are_listed(self):
        for command in ("scan", "init"):
            first, rest = self.expect(USAGE, command).stderr.split("\n", 1)
            self.assertEqual(first, f"panelgate: {command}: DEVICE is missing; `panelgate help {command}` "
                                    "says what it takes")
            self.assertRegex(rest, "^  (no USB adapter is here|USB adapters that are here:)")

    def test_the_demo_and_the_log_name_the_dashboard_first(self):
        with subprocess.Popen([harness.PANELGATE, "demo", "--http", "127.0.0.1:0", "--modbus",
                               "127.0.0.1:0"], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                              text=True) as program:
            try:
                urls = (re.search(r"http://\S+", line) for line in program.stdout)
                self.assertRegex(next(url[0] for url in urls if url),
                                 r"^http://127\.0\.0\.1:\d+/$")
                self.assertTrue(any(re.search(r" info dashboard url=http://127\.0\.0\.1:\d+/$",
                                              line) for line in program.stderr))
            finally:
                program.terminate()

    def test_a_port_that_is_taken_is_told_before_a_panel_is_asked(self):
        with socket.create_server(("127.0.0.1", 0)) as taken:
            ended = self.expect(UNAVAILABLE, "demo", "--http", "127.0.0.1:0", "--modbus",
                                f"127.0.0.1:{taken.getsockname()[1]}")
        self.assertIn("cannot start", ended.stderr)
        self.assertNotIn("line up", ended.stderr)

    def test_a_service_whose_stdout_is_closed_runs_and_ends_like_any_other(self):
        start = 'exec "$0" demo --http 127.0.0.1:0 --modbus 127.0.0.1:0 >&-'
        with subprocess.Popen(["sh", "-c", start, harness.PANELGATE], stderr=subprocess.PIPE,
                              text=True) as program:
            for text in program.stderr:
                if "listening http=" in text:
                    break
            program.terminate()
            told = program.stderr.read()
        self.assertEqual(program.returncode, 0, told)
        self.assertNotIn("stdout", told)

    def test_a_configuration_comes_from_standard_input_too(self):
        for text, code in ((good(), 0), ("lines\n  - name: x\n", BAD_CONFIG)):
            ended = subprocess.run([harness.PANELGATE, "check", "-c", "-"], input=text,
                                   capture_output=True, text=True, timeout=harness.PATIENCE,
                                   check=False)
            self.assertEqual(ended.returncode, code, ended.stderr)
        self.assertIn("/dev/stdin:1:6: a ':' is missing", ended.stderr)

    def test_version_and_help_are_commands_too(self):
        version = self.expect(0, "--version").stdout
        for asked in (["version"], ["-V"]):
            self.assertEqual(self.expect(0, *asked).stdout, version)
        self.assertEqual(self.expect(0, "help").stdout, self.expect(0, "--help").stdout)
        self.assertEqual(self.expect(0, "help", "check").stdout,
                         self.expect(0, "check", "--help").stdout)
        self.assertIn("did you mean 'check'?", self.expect(USAGE, "help", "chek").stderr)

    def test_address_and_profiles_know_those_of_a_directory(self):
        with tempfile.TemporaryDirectory() as folder:
            own = (ROOT / "config/profiles/autonics-gplp-s.yaml").read_text()
            file = pathlib.Path(folder) / "my-panel.yaml"
            file.write_text(own.replace("description: ", "description: my own ", 1))
            given = ("--profiles", folder)
            self.assertRegex(self.expect(0, "profiles", *given).stdout, "(?m)^my-panel +my own ")
            self.assertIn("my own", self.expect(0, "profiles", "my-panel", *given).stdout)
            self.assertIn("UB180 -> coil 288",
                          self.expect(0, "address", "my-panel", "UB180", *given).stdout)
            file.write_text("descriptoin: x\n")
            self.assertIn(f"{file}:1:1: ", self.expect(BAD_CONFIG, "profiles", *given).stderr)
        self.expect(BAD_CONFIG, "profiles", *given)

    def test_an_address_is_translated_both_ways(self):
        first = self.expect(0, "address", "autonics-gplp-s", "UB180").stdout.splitlines()[0]
        self.assertEqual(first, "UB180 -> coil 288 0x0120")
        self.assertIn("UB180", self.expect(0, "address", "autonics-gplp-s", "coil/288").stdout)

    def test_every_profile_is_listed_and_described(self):
        listed = self.expect(0, "profiles").stdout
        for name in ("autonics-gplp-s", "autonics-gplp-a", "autonics-gp-2005", "autonics-arm",
                     "panasonic-gt", "omron-cp2e", "generic"):
            self.assertRegex(listed, rf"(?m)^{name} ")
            self.assertIn(name, self.expect(0, "profiles", name).stdout)

    def test_profiles_stand_in_two_columns(self):
        lines = self.expect(0, "profiles").stdout.splitlines()
        columns = {re.match(r"\S+ {2,}", line).end() for line in lines}
        self.assertEqual(len(columns), 1, lines)


class Files(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.file = pathlib.Path(folder.name) / "gateway.yaml"

    def errors(self, text, code=BAD_CONFIG, command="check"):
        self.file.write_text(text)
        ended = run(command, "-c", str(self.file))
        self.assertEqual(ended.returncode, code, ended.stdout + ended.stderr)
        return ended.stderr

    def test_a_file_that_is_not_there_ends_with_66_in_one_line(self):
        for command in ("run", "check", "simulate"):
            ended = run(command, "-c", str(self.file))
            self.assertEqual(ended.returncode, NO_INPUT)
            self.assertRegex(ended.stderr, rf"^[^\n]*{self.file.name}[^\n]*\n$")
            self.assertIn("`panelgate demo` needs none, `panelgate init DEVICE -o FILE` writes one", ended.stderr)

    def test_an_unknown_key_points_at_itself_and_names_the_nearest(self):
        text = good()
        for command in ("run", "check"):
            errors = self.errors(text.replace("device: sim", "devise: sim"), command=command)
            self.assertIn(f"{self.file}:3:5: ", errors)
            self.assertIn("'device'", errors)

    def test_every_fault_is_told_in_one_run(self):
        errors = self.errors("lines:\n  - name: Floor 1\n    device: sim\n    retries: many\n"
                             "    stations:\n      - {id: 300, profile: nobody}\n")
        for line in (2, 4, 6):
            self.assertRegex(errors, rf"(?m)^{self.file}:{line}:\d+: .")

    def test_broken_yaml_points_at_a_line(self):
        self.assertRegex(self.errors("lines: [\n"), rf"(?m)^{self.file}:\d+:\d+: .")

    def test_the_same_station_on_two_lines_of_a_listener_asks_for_units(self):
        errors = self.errors(
            config.gateway(config.line("a", stations="{id: 1, name: x, profile: generic}"),
                           config.line("b", stations="{id: 1, name: y, profile: generic}"),
                           http=None))
        self.assertIn("units", errors)

    def test_a_port_in_use_ends_with_69_and_names_the_address(self):
        with socket.create_server(("127.0.0.1", 0)) as taken:
            port = taken.getsockname()[1]
            for ports in ((port, 0), (0, port)):
                errors = self.errors(good(*ports), UNAVAILABLE, "run")
                self.assertIn(f"127.0.0.1:{port}", errors)
                told = [line for line in errors.splitlines() if " error " in line]
                self.assertEqual(len(told), 1, errors)

    def test_check_prints_the_plan_as_text_and_json(self):
        self.file.write_text(good())
        text = run("check", "-c", str(self.file)).stdout
        self.assertIn("floor1", text)
        self.assertIn("press", text)
        plan = json.loads(run("check", "-c", str(self.file), "--format", "json").stdout)
        self.assertEqual([line["name"] for line in plan["lines"]], ["floor1"])

    def test_check_prints_all_that_a_file_holds(self):
        self.file.write_text(config.gateway(
            config.line(stations="""{id: 31, name: press, profile: autonics-gplp-s, max_age: 2s,
              poll: [{read: UW0, count: 32, every: 5s}],
              points: [{name: level, at: UW100, writable: true, min: 1, max: 2.5, unit: m}]},
              {id: 20, name: oven, profile: panasonic-gt, access: read_only}""",
                        unlisted_stations="refuse"),
            modbus="listen: 127.0.0.1:502, units: {101: floor1/press}, broadcast: deny, diagnostics_unit: 254, "
                   "allow: [10.0.0.0/8]",
            http="listen: 127.0.0.1:8080, anonymous: none, hosts: [a.example], allow: ['::1']",
            relays="[{from: oven/GDT0, to: press/UW200, every: 3s, on_change: true}]"))
        text = run("check", "-c", str(self.file)).stdout
        for shown in ("station 31 press, autonics-gplp-s, read and write, 5 goes out as 15, 6 goes out as 16, max_age 2s",
                      "station 20 oven, panasonic-gt, read only",
                      "point level: at UW100, type u16, unit m, min 1, max 2.5, writable true",
                      "poll UW0: count 32, every 5s", "other stations: refused",
                      "clients: every request is answered within 2s, so their timeout has to be "
                      "longer; for 500ms set queue: {deadline: 450ms}",
                      "relay oven/GDT0 to press/UW200: every 3s, on_change true",
                      "modbus_tcp 127.0.0.1:502: floor1, read and write, for 10.0.0.0/8",
                      "unit 101 is floor1/31", "unit 254 is the gateway itself",
                      "broadcasts are refused",
                      "http 127.0.0.1:8080: without a token nothing, for ::1/128, as a.example"):
            self.assertIn(shown, text)
        plan = json.loads(run("check", "-c", str(self.file), "--format", "json").stdout)
        [line] = plan["lines"]
        self.assertEqual([[poll[key] for key in ("station", "read", "count", "every_ms")]
                          for poll in line["polls"]],
                         [["press", "UW0", 32, 5000], ["press", "UW100", 1, 1000]])
        clients = line["clients"]
        self.assertEqual((clients["answered_within_ms"], clients["within_500_ms"]["deadline_ms"]),
                         (2000, 450))
        self.assertEqual([s["access"] for s in line["stations"]], ["read_write", "read_only"])
        self.assertEqual(line["stations"][0]["points"][0]["name"], "level")
        self.assertEqual(plan["relays"][0]["to"], "press/UW200")
        self.assertEqual(plan["modbus_tcp"][0]["units"], {"101": "floor1/31"})
        self.assertEqual(plan["modbus_tcp"][0]["diagnostics_unit"], 254)
        self.assertEqual(plan["modbus_tcp"][0]["broadcast"], "deny")
        self.assertEqual(plan["http"]["anonymous"], "none")
        self.assertEqual((plan["valid"], plan["errors"]), (True, []))

    def test_check_says_what_changes_from_another_file(self):
        old = self.file.with_name("old.yaml")
        old.write_text(good())
        self.file.write_text(good() + "# the same\n")
        same = run("check", "-c", str(self.file), "--diff", str(old))
        self.assertEqual((same.returncode, same.stdout),
                         (0, f"nothing changes from {old} to {self.file}\n"))
        self.file.write_text(good() + "log: {level: warn}\n"
                             "relays: [{from: press/UW0, to: press/UW100}]\n")
        text = run("check", "-c", str(self.file), "--diff", str(old))
        self.assertEqual((text.returncode, text.stdout),
                         (0, f"2 change(s) from {old} to {self.file}:\n  log: level info -> warn\n"
                             "  relays/press/UW0 to press/UW100: added\n"))
        told = json.loads(run("check", "-c", str(self.file), "--diff", str(old),
                              "--format", "json").stdout)
        self.assertEqual(told["changes"], [
            {"path": "log/level", "kind": "changed", "before": "info", "after": "warn"},
            {"path": "relays/press/UW0 to press/UW100", "kind": "added"}])
        self.assertEqual((told["valid"], told["interruptions"]), (True, []))

    def test_a_comparison_says_what_a_reload_interrupts(self):
        old = self.file.with_name("old.yaml")
        old.write_text(good())
        self.file.write_text(good().replace("device: sim", "device: /dev/ttyUSB7"))
        text = run("check", "-c", str(self.file), "--diff", str(old)).stdout
        self.assertIn("what a reload interrupts:\n  lines/floor1: the port is opened anew\n", text)
        told = json.loads(run("check", "-c", str(self.file), "--diff", str(old), "--format", "json").stdout)
        self.assertEqual(told["interruptions"], [{"path": "lines/floor1", "what": "the port is opened anew"}])

    def test_a_comparison_tells_the_faults_of_both_files(self):
        old = self.file.with_name("old.yaml")
        old.write_text(good().replace("device: sim", "devise: sim"))
        self.file.write_text(good().replace("data_bits: 8", "data_bits: 9"))
        both = run("check", "-c", str(self.file), "--diff", str(old))
        self.assertEqual((both.returncode, both.stdout), (BAD_CONFIG, ""))
        self.assertIn(f"{old}:3:5: ", both.stderr)
        self.assertIn(f"{self.file}:4:38: ", both.stderr)
        self.file.write_text(good())
        one = run("check", "-c", str(self.file), "--diff", str(old), "--format", "json")
        self.assertEqual(one.returncode, BAD_CONFIG)
        told = json.loads(one.stdout)
        self.assertNotIn("changes", told)
        self.assertEqual({error["file"] for error in told["errors"]}, {str(old)})
        self.assertFalse(told["valid"])
        gone = run("check", "-c", str(self.file), "--diff", str(old) + "x", "--format", "json")
        self.assertEqual((gone.returncode, json.loads(gone.stdout)["valid"]), (NO_INPUT, False))
        self.assertIn(f"cannot read {old}x: ", gone.stderr)
        self.assertIn("(give another file with --diff)", gone.stderr)
        for nothing in (["--diff", ""], ["--diff="]):
            none = run("check", "-c", str(self.file), *nothing)
            self.assertEqual((none.returncode, none.stdout), (USAGE, ""))
            self.assertIn("--diff", none.stderr)

    def test_check_tells_errors_as_json_too(self):
        self.file.write_text(good().replace("device: sim", "devise: sim")
                             .replace("data_bits: 8", "data_bits: 9"))
        ended = run("check", "-c", str(self.file), "--format", "json")
        self.assertEqual(ended.returncode, BAD_CONFIG)
        told = json.loads(ended.stdout)
        self.assertFalse(told["valid"])
        places = [(e["file"], e["line"], e["column"]) for e in told["errors"]]
        self.assertEqual(places, [(str(self.file), 3, 5), (str(self.file), 4, 38)])
        for error in told["errors"]:
            self.assertIn("{file}:{line}:{column}: {message}".format(**error), ended.stderr)
        gone = run("check", "-c", str(self.file) + "x", "--format", "json")
        self.assertEqual(gone.returncode, NO_INPUT)
        self.assertIn("No such file", json.loads(gone.stdout)["errors"][0]["message"])

    def test_errors_as_json_are_text_whatever_the_name_of_the_file(self):
        path = os.path.join(os.fsencode(self.file.parent), b"caf\xe9.yaml")
        with open(path, "wb") as file:
            file.write(good().replace("device: sim", "devise: sim").encode())
        ended = subprocess.run([harness.PANELGATE, "check", "-c", path, "--format", "json"],
                               capture_output=True, check=False)
        told = json.loads(ended.stdout.decode("utf-8"))
        self.assertTrue(told["errors"][0]["file"].endswith("caf\ufffd.yaml"))

    def test_import_makes_a_configuration_that_check_takes(self):
        conf = self.file.with_name("mbusd.conf")
        conf.write_text("# mbusd\ndevice = /dev/ttyS5\nspeed = 9600\nmode = 8e1\nport = 1502\n"
                        "address = 127.0.0.1\npause = 100\n")
        made = run("import", str(conf))
        self.assertEqual(made.returncode, 0, made.stderr)
        self.assertEqual(made.stderr.count("\n"), 1)
        self.assertTrue(made.stderr.startswith(f"{conf}:7: pause = 100: "), made.stderr)
        self.file.write_text(made.stdout)
        checked = run("check", "-c", str(self.file), "--format", "json")
        self.assertEqual((checked.returncode, checked.stderr), (0, ""))
        plan = json.loads(checked.stdout)
        self.assertEqual((plan["lines"][0]["device"], plan["modbus_tcp"][0]["listen"]),
                         ("/dev/ttyS5", "127.0.0.1:1502"))

    def test_import_says_where_a_file_is_wrong(self):
        conf = self.file.with_name("mbusd.conf")
        conf.write_text("speed 9600\nport = many\n")
        ended = run("import", str(conf))
        self.assertEqual((ended.returncode, ended.stdout), (BAD_CONFIG, ""))
        self.assertIn(f"{conf}:1:1: a line must be NAME = VALUE", ended.stderr)
        self.assertIn(f"{conf}:2:8: port must be a whole number", ended.stderr)
        out = self.file.with_name("out.yaml")
        self.assertEqual(run("import", str(conf), "-o", str(out)).returncode, BAD_CONFIG)
        self.assertFalse(out.exists(), "nothing is left behind")
        conf.write_text("ExecStart=/usr/bin/mbusd -d -p /dev/ttyS5 -s 9600\n")
        self.assertEqual(run("import", str(conf), "-o", str(out)).returncode, 0)
        self.assertIn("device: '/dev/ttyS5'", out.read_text())
        gone = run("import", str(conf) + "x")
        self.assertEqual(gone.returncode, NO_INPUT)
        self.assertIn("No such file", gone.stderr)

    def test_a_token_that_is_a_pipe_is_an_error_and_holds_nobody_up(self):
        pipe = self.file.with_name("pipe")
        os.mkfifo(pipe)
        self.file.write_text(config.gateway(config.line(), http="listen: 127.0.0.1:0, tokens: "
                             f"[{{name: ops, role: operator, file: {pipe}}}]"))
        for command in ("check", "run"):
            ended = run(command, "-c", str(self.file))
            self.assertEqual(ended.returncode, BAD_CONFIG)
            self.assertIn("not a pipe, a socket or a device", ended.stderr)

    def test_a_configuration_may_come_through_a_pipe(self):
        ended = subprocess.run([harness.PANELGATE, "check", "-c", "/dev/stdin"], input=good().encode(),
                               capture_output=True, check=False)
        self.assertEqual(ended.returncode, 0)

    def test_a_line_is_simulated_in_one_place(self):
        self.file.write_text(good())
        link = ("--line", "floor1=" + str(self.file.with_name("tty")))
        ended = run("simulate", "-c", str(self.file), *link, *link)
        self.assertEqual(ended.returncode, USAGE)
        self.assertIn("line 'floor1' has been given already", ended.stderr)

    def test_check_warns_of_a_token_that_others_can_read(self):
        token = self.file.with_name("token")
        token.write_text("0123456789abcdef")
        token.chmod(0o644)
        self.file.write_text(config.gateway(config.line(), http="listen: 127.0.0.1:0, tokens: "
                             f"[{{name: ops, role: operator, file: {token}}}]"))
        warned = run("check", "-c", str(self.file))
        self.assertEqual(warned.returncode, 0)
        self.assertIn(f"chmod o-r {token}", warned.stderr)
        token.chmod(0o640)
        self.assertEqual(run("check", "-c", str(self.file)).stderr, "")

    def test_values_come_from_the_environment(self):
        self.file.write_text(good().replace("38400", "${PANELGATE_TEST_BAUD}"))
        unset = run("check", "-c", str(self.file))
        self.assertEqual(unset.returncode, BAD_CONFIG)
        self.assertIn("the environment has no PANELGATE_TEST_BAUD", unset.stderr)
        given = run("check", "-c", str(self.file),
                    env={**os.environ, "PANELGATE_TEST_BAUD": "38400"})
        self.assertIn("38400 8N1", given.stdout)

    def test_every_shipped_configuration_is_valid(self):
        files = sorted((ROOT / "config").glob("*.yaml"))
        self.assertIn("demo.yaml", [file.name for file in files])
        for file in files:
            ended = run("check", "-c", str(file), cwd=ROOT)
            self.assertEqual(ended.returncode, 0, ended.stderr)


if __name__ == "__main__":
    unittest.main()
