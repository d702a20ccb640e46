"""`panelgate profiles --check`: a file that describes a panel, judged before anything loads it."""
import pathlib
import subprocess
import tempfile
import unittest

import harness
from harness import ROOT, run

USAGE, NO_INPUT, BAD_CONFIG = 64, 66, 78
SHIPPED = ROOT / "config/profiles"


class Check(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.file = pathlib.Path(folder.name) / "acme-meter.yaml"
        self.text = (SHIPPED / "autonics-gplp-s.yaml").read_text()

    def check(self, code, text):
        self.file.write_text(text)
        ended = run("profiles", "--check", str(self.file))
        self.assertEqual(ended.returncode, code, ended.stdout + ended.stderr)
        return ended

    def test_a_good_file_is_told_what_was_understood(self):
        ended = self.check(0, self.text)
        self.assertRegex(ended.stdout, rf"^{self.file} is valid: profile acme-meter, \d+ areas, \d+ functions, ")
        self.assertEqual(ended.stderr, "")

    def test_every_shipped_profile_is_good(self):
        files = sorted(path for path in SHIPPED.glob("*.yaml"))
        self.assertGreaterEqual(len(files), 6)
        for file in files:
            ended = run("profiles", "--check", str(file))
            self.assertEqual(ended.returncode, 0, ended.stderr)
            self.assertIn(f"takes the place of the shipped profile {file.stem}", ended.stderr)

    def test_all_faults_have_their_place_and_what_would_be_right(self):
        told = self.check(BAD_CONFIG, self.text.replace("functions:", "funktions:", 1)
                          .replace("areas:", "areas:\n  - {name: x}", 1)).stderr
        self.assertRegex(told, rf"(?m)^{self.file}:\d+:\d+: .*'funktions'.*did you mean 'functions'")
        self.assertRegex(told, rf"(?m)^{self.file}:\d+:\d+: an area needs 'readable'")
        loaded = run("profiles", "--profiles", str(self.file.parent))
        self.assertEqual((loaded.returncode, loaded.stderr), (BAD_CONFIG, told), "as load judges it")
        self.assertRegex(self.check(BAD_CONFIG, "description: x\n").stderr, rf"^{self.file}:1:1: ")

    def test_what_is_no_file_is_told(self):
        gone = run("profiles", "--check", str(self.file))
        self.assertEqual((gone.returncode, gone.stdout), (NO_INPUT, ""))
        self.assertIn(f"cannot read {self.file}: No such file", gone.stderr)
        for words in (["--check"], ["--check", ""], ["--check", "x.yaml", "autonics-gplp-s"]):
            ended = run("profiles", *words)
            self.assertEqual((ended.returncode, ended.stderr.count("\n")), (USAGE, 1), ended.stderr)
        ended = subprocess.run([harness.PANELGATE, "profiles", "--check", "-"], input=self.text, text=True,
                               capture_output=True, timeout=harness.PATIENCE, check=False)
        self.assertEqual(ended.returncode, 0, ended.stderr)

    def test_a_part_of_a_name_is_enough_for_a_suggestion(self):
        self.assertIn("did you mean 'panasonic-gt'?", run("profiles", "panasonic").stderr)


if __name__ == "__main__":
    unittest.main()
