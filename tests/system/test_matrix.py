"""Foreign clients against all five panels: single and several reads and writes by their own calls, values
read back, frames on the bus counted. The clients that every build has; tests/bench/matrix.py has the others."""
import contextlib
import os
import pathlib
import sys
import unittest

import harness

os.environ.setdefault("FOREIGN_BUILT", str(pathlib.Path(harness.PANELGATE).resolve().parent))
sys.path[:0] = [str(harness.ROOT / "tests/bench"), str(harness.ROOT / "tests/bench/foreign")]
import matrix  # noqa: E402
import plain_clients  # noqa: E402


class Liar(plain_clients.Mbpoll):
    """Tells other values than it has read, writes others than it was told to, and does all twice."""

    @contextlib.contextmanager
    def running(self, port, folder, calls):
        with super().running(port, folder, calls) as ask:
            def lie(verb, table, unit, address, values):
                others = values if verb == "read" else [value ^ 1 for value in values]
                ask(verb, table, unit, address, others)
                answer = ask(verb, table, unit, address, others)
                return answer + " 1" if verb == "read" else answer
            yield lie


class Matrix(unittest.TestCase):
    def holds(self, name):
        [client] = [one for one in plain_clients.everyone() if one.name == name]
        if reason := client.missing():
            self.skipTest(reason)
        for panel, result in matrix.try_client(client, seed=7).items():
            with self.subTest(panel=panel.name):
                self.assertEqual(result.broken, [])
                self.assertGreater(result.right, 0)

    def test_mbpoll_reads_and_writes_all_panels(self):
        self.holds("mbpoll")

    def test_libmodbus_reads_and_writes_all_panels(self):
        self.holds("libmodbus")

    def test_pymodbus_reads_and_writes_all_panels(self):
        self.holds("pymodbus")

    def test_wrong_values_and_needless_frames_are_noticed(self):
        for panel, result in matrix.try_client(Liar("liar"), seed=7).items():
            with self.subTest(panel=panel.name):
                told = "\n".join(result.broken)
                for fault in ("1 instead of ok", "there is ok", "functions [3, 3] on the bus instead of [3]"):
                    self.assertIn(fault, told)
                self.assertEqual((result.right, len(result.broken)), (0, result.calls))


if __name__ == "__main__":
    unittest.main()
