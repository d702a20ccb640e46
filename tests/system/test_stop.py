"""P3: who ends the gateway waits for the answers that it owes."""
import contextlib
import pathlib
import signal
import tempfile
import unittest

import config
import harness
from harness import read_registers
from rtu_bus import Pieces, RtuBus

SLOW = 11  # seconds of a panel: longer than the ten that were given to every answer


@contextlib.contextmanager
def awaited(answer):
    """The program and its client, whose request the one panel has heard; `answer` is its own."""
    with tempfile.TemporaryDirectory() as folder:
        link = pathlib.Path(folder) / "tty"
        slow = config.line("slow", link, "{id: 1, name: one}", timing="{response_timeout: 15s}",
                           queue="{deadline: 20s}")
        with RtuBus(link, {1: lambda frame: answer}) as bus, \
                harness.configured(config.gateway(slow)) as program, program.client() as client:
            program.log.wait_for("line up")
            client.send(1, read_registers(0))
            bus.wait_for(1)
            yield program, client


class Stop(unittest.TestCase):
    def test_P3_sigterm_waits_for_as_long_as_the_longest_deadline(self):
        reply = harness.rtu(1, b"\x03\x02\x00\x2a")
        with awaited(Pieces([(SLOW, reply)])) as (program, client):
            program.process.terminate()
            self.assertEqual(client.receive()[2], b"\x03\x02\x00\x2a")
            self.assertEqual(program.wait(), 0)

    def test_signals_that_rotate_logs_elsewhere_end_nothing(self):
        with harness.configured(config.gateway(config.line())) as program:
            for habit in (signal.SIGUSR1, signal.SIGUSR2, signal.SIGHUP):
                program.process.send_signal(habit)
            program.log.wait_for("reload outcome=unchanged")
            self.assertIsNone(program.process.poll())

    def test_a_second_sigterm_right_behind_changes_nothing_where_nobody_is_owed_an_answer(self):
        for _ in range(10):
            with harness.configured(config.gateway(config.line())) as program:
                program.process.send_signal(signal.SIGTERM)
                while program.process.poll() is None:
                    program.process.send_signal(signal.SIGTERM)

    def test_a_second_sigterm_ends_at_once_with_a_code_and_a_line_when_requests_are_cut(self):
        with awaited(None) as (program, _):
            program.process.terminate()
            program.log.wait_for("info stopping")
            program.process.terminate()
            program.ends_with = 1
            self.assertEqual(program.wait(), 1)
            self.assertIn('warn stopped at once why="a second signal came: what is in '
                          'flight is not answered" connections=1',
                          program.log.finished_text())


if __name__ == "__main__":
    unittest.main()
