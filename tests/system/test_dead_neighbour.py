"""A panel that is built on libmodbus beside panels that are off, on a paced wire."""
import contextlib
import pathlib
import tempfile
import time
import unittest

import config
import harness
from harness import read_registers, write_register
from sound_line import Poller
from zoo_line import WRITABLE, ZOO_BUS, in_parallel, is_value

BUILT = pathlib.Path(ZOO_BUS).resolve().parent


def failed(poller):
    """Requests to panel 1 that were not answered with its value, or confirmed."""
    return [reply.hex() for pdu, reply in poller.replies if not is_value(1, pdu, reply)]


@unittest.skipUnless((BUILT / "libmodbus_slave").exists() and (BUILT / "serial_pair").exists(),
                     "libmodbus-dev is not here")
class DeadNeighbour(unittest.TestCase):
    """libmodbus's own RTU server waits for up to 500 ms for the reply of a panel that it hears being
    asked, and takes whatever comes for that reply (T1)."""
    SECONDS = 10
    BAUD = 38400

    def beside(self, dead, stations):
        """(reads, writes, times that the panel went offline): a good panel beside dead panels."""
        with contextlib.ExitStack() as stack:
            folder = stack.enter_context(tempfile.TemporaryDirectory())
            near, far = f"{folder}/near", f"{folder}/far"
            pair = stack.enter_context(
                harness.Helper([BUILT / "serial_pair", self.BAUD, far, near]))
            pair.out.wait_for("ready")
            panel = stack.enter_context(
                harness.Helper([BUILT / "libmodbus_slave", far, self.BAUD, 1]))
            panel.out.wait_for("ready")
            program = stack.enter_context(harness.configured(config.gateway(
                config.line(device=near, baud=self.BAUD, stations=stations))))
            program.log.wait_for("line up")
            polls = [stack.enter_context(Poller(program, 1, *poll)) for poll in (
                (lambda n: read_registers(n % 50, 2), 0.25),
                (lambda n: write_register(WRITABLE + n % 9, n % 1000), 0.7))]
            for unit, request in dead.items():
                stack.enter_context(Poller(program, unit, request, 1))
            time.sleep(self.SECONDS)
            offline = [text for text in program.log.text().splitlines()
                       if "station offline" in text and "good" in text]
            return (*polls, len(offline))

    def test_a_panel_of_libmodbus_is_answered_beside_neighbours_that_are_off(self):
        good, off = "{id: 1, name: good}", "{id: 2, name: off}"
        read, write = lambda n: read_registers(n), lambda n: write_register(0, n)
        cases = {"a listed panel is off": ({2: read}, f"{good}, {off}"),
                 "and is written": ({2: write}, f"{good}, {off}"),
                 "panels that nobody listed are off": ({7: read, 9: read}, good)}
        results = in_parallel(lambda case: self.beside(*case), list(cases.values()))
        for name, (reads, writes, offline) in zip(cases, results):
            print(f"\n  {name}: {len(failed(reads))} of {len(reads.replies)} reads failed, "
                  f"{len(failed(writes))} of {len(writes.replies)} writes", end="")
        for name, (reads, writes, offline) in zip(cases, results):
            with self.subTest(name):
                self.assertGreater(len(reads.replies), self.SECONDS / 2)
                # libmodbus's 500 ms begin when its process runs: a busy machine may delay one.
                self.assertLessEqual(len(failed(reads)), 1)
                self.assertLessEqual(len(failed(writes)), 1)
                self.assertEqual(offline, 0)


if __name__ == "__main__":
    unittest.main()
