"""The bench runs and judges (skipped where the source of its bus is not there); figures are its affair."""
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

import paced

DRIVER = pathlib.Path(paced.wire.__file__).with_name("driver.py")
LIFE = DRIVER.with_name("life.py")


@unittest.skipUnless((paced.wire.TOOLS / "bare.cpp").exists(), "there is no bare.cpp")
class Bench(unittest.TestCase):
    def test_a_topic_leaves_json_a_table_and_a_plot(self):
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder)
            done = subprocess.run(
                [sys.executable, "-B", str(DRIVER), "--quick", "--only", "start", "--only", "tcp",
                 "--no-rivals", "--out", folder], capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            figures = json.loads((out / "results.json").read_text())["figures"]
            judged = [one for one in figures if "holds" in one]
            self.assertEqual([one["case"] for one in judged], ["unpaced tcp://, 10 registers"])
            self.assertTrue(all(one["value"] > 0 for one in figures))
            self.assertIn("CPU us a transaction", (out / "table.md").read_text())
            self.assertIn("</svg>", (out / "plot.svg").read_text())


class OrdinaryLife(unittest.TestCase):
    def test_gateway_and_bridge_are_asked_the_same_and_no_value_of_the_gateway_is_wrong(self):
        done = subprocess.run([sys.executable, "-B", str(LIFE), "--scene", "one reply lost",
                               "--seconds", "6"], capture_output=True, text=True, check=False)
        self.assertIn(done.returncode, (0, 1), done.stdout + done.stderr)
        rows = {line.split("all on")[1].split()[0]: line.split()
                for line in done.stdout.splitlines() if "all on  " in line}
        self.assertEqual(set(rows), {"gateway", "bridge"}, done.stdout + done.stderr)
        asked = {who: int(row[-7]) for who, row in rows.items()}
        self.assertGreater(asked["gateway"], 0)
        self.assertEqual(asked["gateway"], asked["bridge"])
        self.assertEqual(rows["gateway"][-1], "0", done.stdout)


if __name__ == "__main__":
    unittest.main()
