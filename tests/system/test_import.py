"""`panelgate import` of other programs' lists of tags: what is made passes `check`."""
import pathlib
import tempfile
import unittest

from harness import ROOT, run

HUB = "modbus:\n  - name: modbus_hub\n    type: {type}\n    host: {host}\n    port: 502\n    sensors:\n"
SERIAL = """modbus:
  - {name: a, type: serial, port: /dev/ttyS0, method: rtu, delay: 1, sensors: [{name: x, address: 1, slave: 248}]}
"""
PLUGIN = '[[inputs.modbus]]\nslave_id = 1\nname = "my_device"\ncontroller = "{controller}"\n{more}\n' \
         'coils = [{{name = "null", address = [0]}}]\n'
CSV = "Tag Name,Address,Data Type,Client Access,Scan Rate,Eng Units\n"

# What is typed -> the points that are taken, and a part of each note.
CASES = {
    "names that are no texts": (CSV + "null,400001,Word\n~,400002,Word\ntrue,400003,Word\n1e3,400004,Word\n", 4, [
        "names no device", "First word low"]),
    "writes of a read only table": (CSV + "x,300005,Word,R/W\ny,100005,Boolean,R/W\n", 2, [
        "names no device", "First word low", "x: writes", "y: writes"]),
    "units like YAML": (CSV + 'x,400001,Word,,,"a, b: {c}"\ny,400002,Word,,,~\nz,400003,Word,,,"q\nr"\n', 3, [
        "names no device", "First word low"]),
    "too many points": (CSV + "".join(f"x,4{i:05},Word\n" for i in range(1, 4100)), 4096, [
        "names no device", "First word low", *3 * ["x: the station has 4096 points already"]]),
    "sensors that cannot be": (HUB.format(type="tcp", host="fe80::1") + """\
      - {name: good, address: 1, nan_value: 0x8000}
      - {name: end, address: 65535, data_type: int32}
      - {name: behind, address: 65536}
      - {name: zero, address: 2, scale: 0}
      - {name: long, address: 3, data_type: string, count: 200}
      - {name: slow, address: 4, scan_interval: 100000}
      - {name: none, address: 5, slave: 0}
""", 2, ["end: 2 registers from 465536 reach", "behind: address 65536", "zero: scale must not be 0", "long: length must",
         "slow: its interval", "none: station 0"]),
    "settings that cannot be": (SERIAL, 1, ["a: connect_pause belongs to a tcp:// line"]),
    "hosts that cannot be": (HUB.format(type="rtuovertcp", host="a/b") + "      - {name: x, address: 1}\n" +
                             HUB.format(type="tcp", host="10.0.0.5")[8:] + "      - {name: y, address: 1}\n",
                             1, ["modbus_hub: device must be"]),
    "more than 255 stations": ("modbus:\n" + "".join(
        f"  - {{name: {hub}, type: tcp, host: {hub}, sensors: [" +
        ", ".join(f"{{name: s, address: 1, slave: {i}}}" for i in range(1, 129)) + "]}\n" for hub in "ab"),
        255, ["b/128: no unit id"]),
    "a plugin": (PLUGIN.format(controller="tcp://[::1]", more='timeout = "5m"\nbusy_retries = 3'), 1, [
        "my_device: response_timeout must be", "my_device: busy_retries"]),
    "a port's path": (PLUGIN.format(controller="/dev/ttyS1", more="baud_rate = 19200\n"), 1, []),
}


class Import(unittest.TestCase):
    def imported(self, source):
        """What was made passes `check`: its text, what `check` says, and the notes."""
        with tempfile.TemporaryDirectory() as folder:
            made = pathlib.Path(folder) / "panelgate.yaml"
            done = run("import", str(source), "-o", str(made))
            self.assertEqual(done.returncode, 0, done.stderr)
            checked = run("check", "-c", str(made))
            self.assertEqual(checked.returncode, 0, checked.stderr)
            notes = done.stderr.splitlines()
            self.assertEqual(made.read_text().count("# not taken over: "), len(notes))
            return made.read_text(), checked.stdout, notes

    def test_what_is_made_of_each_program_passes_check(self):
        for name, lines, notes in (("kepware.csv", 1, 5), ("telegraf.conf", 2, 1), ("configuration.yaml", 2, 2)):
            with self.subTest(name):
                _, checked, told = self.imported(ROOT / "tests/data/imports" / name)
                self.assertIn(f"is valid: {lines} line(s)", checked)
                self.assertEqual(len(told), notes, told)

    def test_what_check_refuses_is_listed_and_not_written(self):
        for name, (text, points, notes) in CASES.items():
            with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                source = pathlib.Path(folder) / "typed"
                source.write_text(text)
                made, _, told = self.imported(source)
                self.assertEqual(made.count("- {name: "), points)
                self.assertEqual(len(told), len(notes), told)
                for note, line in zip(notes, told):
                    self.assertIn(note, line)

    def test_a_file_with_faults_is_told_and_nothing_is_written(self):
        for name, text, place in (("telegraf.conf", "[[inputs.modbus]]\nname = \n", "telegraf.conf:2:"),
                                  ("tags.csv", CSV + "x,500001,Word\n", "tags.csv:2:")):
            with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                wrong = pathlib.Path(folder) / name
                wrong.write_text(text)
                made = pathlib.Path(folder) / "panelgate.yaml"
                done = run("import", str(wrong), "-o", str(made))
                self.assertEqual(done.returncode, 78)
                self.assertIn(place, done.stderr)
                self.assertFalse(made.exists())


if __name__ == "__main__":
    unittest.main()
