"""`panelgate import` of other programs' lists of tags: what is made passes `check`."""
import pathlib
import tempfile
import unittest

from harness import ROOT, run


class Import(unittest.TestCase):
    def test_what_is_made_of_each_program_passes_check(self):
        for name, lines, notes in (("kepware.csv", 1, 4), ("telegraf.conf", 2, 1), ("configuration.yaml", 2, 2)):
            with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                made = pathlib.Path(folder) / "panelgate.yaml"
                done = run("import", str(ROOT / "tests/data/imports" / name), "-o", str(made))
                self.assertEqual((done.returncode, len(done.stderr.splitlines())), (0, notes), done.stderr)
                checked = run("check", "-c", str(made))
                self.assertEqual(checked.returncode, 0, checked.stderr)
                self.assertIn(f"is valid: {lines} line(s)", checked.stdout)
                self.assertEqual(made.read_text().count("# not taken over: "), notes)

    def test_a_file_with_faults_is_told_and_nothing_is_written(self):
        with tempfile.TemporaryDirectory() as folder:
            wrong = pathlib.Path(folder) / "telegraf.conf"
            wrong.write_text("[[inputs.modbus]]\nname = \n")
            made = pathlib.Path(folder) / "panelgate.yaml"
            done = run("import", str(wrong), "-o", str(made))
            self.assertEqual(done.returncode, 78)
            self.assertIn("telegraf.conf:2:", done.stderr)
            self.assertFalse(made.exists())


if __name__ == "__main__":
    unittest.main()
