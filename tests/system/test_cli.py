"""The command line: exit codes, and what a person reads when something is wrong."""
import json
import pathlib
import socket
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
        self.assertRegex(self.expect(0, "--version").stdout, r"^panelgate \d+\.\d+\.\d+\n$")
        text = self.expect(0, "--help").stdout
        for command in ("run", "demo", "check", "simulate", "address", "profiles"):
            self.assertRegex(text, rf"(?m)^\s+{command}\b")
            self.assertIn("Usage", self.expect(0, command, "--help").stdout)

    def test_wrong_usage_ends_with_64_and_says_why(self):
        for arguments in ([], ["fly"], ["run", "--fly"], ["check", "--format", "xml"], ["address"],
                          ["address", "autonics-gplp-s"], ["demo", "--http", "nowhere"],
                          ["profiles", "autonics-gplp"], ["address", "nobody", "UB1"],
                          ["address", "autonics-gplp-s", "XY12"]):
            with self.subTest(arguments=arguments):
                self.assertNotEqual(self.expect(USAGE, *arguments).stderr.strip(), "")

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

    def test_every_shipped_configuration_is_valid(self):
        files = sorted((ROOT / "config").glob("*.yaml"))
        self.assertIn("demo.yaml", [file.name for file in files])
        for file in files:
            ended = run("check", "-c", str(file), cwd=ROOT)
            self.assertEqual(ended.returncode, 0, ended.stderr)


if __name__ == "__main__":
    unittest.main()
