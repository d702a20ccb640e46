"""`panelgate init`: a configuration of what a scan has found, which check takes and run runs."""
import json
import os
import pathlib
import re
import select
import signal
import subprocess
import tempfile
import unittest

import config
import harness
from harness import read_registers, run
from test_scan import drain, simulated, six, terminal

PANELS = "{id: 31, profile: autonics-gplp-s}, {id: 20, profile: panasonic-gt}"
SEARCH = ("--baud", "38400", "--parity", "none", "--stations", "19-21,31")


def init(*arguments):
    return subprocess.run([harness.PANELGATE, "init", *arguments], stdin=subprocess.DEVNULL,
                          capture_output=True, text=True, timeout=120, check=False)


def check(file):
    return run("check", "-c", str(file), "--format", "json")


class Init(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.file = pathlib.Path(folder.name) / "panelgate.yaml"

    def test_writes_what_check_takes_and_run_runs(self):
        with simulated(config.line("left", stations=PANELS)) as links:
            made = init(links["left"], *SEARCH, "-o", str(self.file))
            self.assertEqual((made.returncode, made.stdout), (0, ""), made.stderr)
            self.assertIn(f"wrote {self.file} with 2 station(s); to run it: panelgate run -c {self.file}\n", made.stderr)
            checked = check(self.file)
            self.assertEqual(checked.returncode, 0, checked.stderr)
            line = json.loads(checked.stdout)["lines"][0]
            self.assertEqual({s["id"]: s["profile"] for s in line["stations"]},
                             {31: "autonics-gplp-s", 20: "panasonic-gt"})
            self.assertEqual(line["serial"], "38400 8N1")
            # As it is, but for ports that others on this machine may have.
            text = re.sub(r"127\.0\.0\.1:\d+", "127.0.0.1:0", self.file.read_text())
            self.file.write_text(text.replace("127.0.0.1:0/", "127.0.0.1:8080/"))
            with harness.Program("run", "-c", str(self.file)) as program:
                with program.client() as client:
                    self.assertEqual(client.ask(31, read_registers(0, 2)),
                                     b"\x03\x04\x00\x0a\x00\x14")

    def test_prints_it_and_never_writes_over_a_file_without_force(self):
        self.file.write_text("mine\n")
        refused = init("/dev/null", "-o", str(self.file))
        self.assertEqual((refused.returncode, self.file.read_text()), (64, "mine\n"))
        self.assertIn("is there already", refused.stderr)
        with simulated(config.line("left", stations=PANELS)) as links:
            printed = init(links["left"], *SEARCH)
            self.assertEqual(printed.returncode, 0, printed.stderr)
            spaced = self.file.with_name("my panels.yaml")
            self.assertIn(f"panelgate run -c '{spaced}'\n",
                          init(links["left"], *SEARCH, "--quick", "-o", str(spaced)).stderr)
            self.assertEqual(spaced.read_text(), printed.stdout, "--quick leaves nothing out of these")
            forced = init(links["left"], *SEARCH, "-o", str(self.file), "--force")
            self.assertEqual(forced.returncode, 0, forced.stderr)
        self.assertEqual(self.file.read_text(), printed.stdout)

    def test_examples_of_points_are_valid_as_they_are(self):
        with simulated(config.line("left", stations=PANELS)) as links:
            text = init(links["left"], *SEARCH).stdout
        self.file.write_text(re.sub(r"(?m)^        # (points:|  - )", r"        \1", text))
        checked = check(self.file)
        self.assertEqual(checked.returncode, 0, checked.stderr)
        for station in json.loads(checked.stdout)["lines"][0]["stations"]:
            self.assertGreaterEqual(len(station["points"]), 1)

    def test_over_tcp(self):
        with tempfile.TemporaryDirectory() as folder:
            lines = pathlib.Path(folder) / "lines.yaml"
            lines.write_text(config.gateway(config.line("left", stations=PANELS), http=None))
            with harness.Program("simulate", "-c", str(lines),
                                 "--line", "left=tcp://127.0.0.1:0") as program:
                port = program.log.wait_for(r"rtu_over_tcp=127\.0\.0\.1:(\d+)").group(1)
                device = f"tcp://127.0.0.1:{port}"
                made = init(device, "--stations", "19-21,31", "-o", str(self.file))
        self.assertEqual(made.returncode, 0, made.stderr)
        text = self.file.read_text()
        self.assertIn(f'device: "{device}"', text)
        self.assertIn("supposed from the panels", text)
        self.assertEqual(check(self.file).returncode, 0)

    def test_says_on_stderr_that_an_interrupted_scan_is_incomplete(self):
        with simulated(six("left")) as links, terminal() as (ours, theirs):
            process = subprocess.Popen(
                [harness.PANELGATE, "init", links["left"], "-o", str(self.file)],
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=theirs, text=True)
            seen = ""
            # Those that were quick have been looked at, the others are asked with patience.
            while (not re.search(r"(?s)looking at.*left at most: 38400 8N1, station", seen)
                   and process.poll() is None):
                if select.select([ours], [], [], 0.1)[0]:
                    seen += os.read(ours, 4096).decode()
            process.send_signal(signal.SIGINT)
            told = drain(ours, process)
            process.communicate(timeout=harness.PATIENCE)
        self.assertEqual(process.returncode, 69, told)
        self.assertTrue(self.file.exists(), told)
        self.assertIn("# Incomplete", self.file.read_text())
        self.assertIn("incomplete: interrupted; what was not reached is missing in it", told)

    def test_what_cannot_be_written_is_told_before_anything_is_asked(self):
        (self.file.parent / "file").touch()
        for file in (self.file.parent / "none" / "x.yaml", self.file.parent / "file" / "x.yaml",
                     self.file.parent, f"{self.file.parent}/none/"):
            with self.subTest(file=file), terminal() as (ours, theirs):
                ended = init(os.ttyname(theirs), "--force", "-o", str(file))
                self.assertEqual((ended.returncode, ended.stdout), (70, ""), ended.stderr)
                self.assertIn(f"cannot write {file}: ", ended.stderr)
                self.assertEqual(select.select([ours], [], [], 0)[0], [], "a byte was sent")

    def test_where_nothing_answers_nothing_is_written(self):
        master, slave = os.openpty()
        try:
            ended = init(os.ttyname(slave), "--baud", "115200", "--parity", "none",
                         "--stations", "1", "-o", str(self.file))
        finally:
            os.close(master)
            os.close(slave)
        self.assertEqual((ended.returncode, self.file.exists()), (69, False), ended.stderr)
        self.assertIn("nothing to write", ended.stderr)


if __name__ == "__main__":
    unittest.main()
