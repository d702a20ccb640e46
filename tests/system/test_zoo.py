"""Odd panels of T1 to T14 on a paced line: no wrong value, and the healthy ones go on."""
import asyncio
import itertools
import time
import unittest

import harness
from harness import read_registers
from zoo_line import (counted, every_kind_of_write, in_parallel, merged, odd_line, outcome,
                      read_all)


class Echoes(unittest.TestCase):
    def test_P1_a_partial_echo_never_brings_the_value_of_another_request(self):
        # The receiver comes back late from sending: two to seven bytes of the request are heard, and
        # 30 ms later the reply. A second request meanwhile is served after the first.
        def sixty_reads(heard):
            habits = {"all": f"think-30ms,echo-partial-{heard}"}
            with odd_line(38400, [5], habits) as line, line.program.client() as client:
                end = time.monotonic() + 12
                addresses = itertools.takewhile(lambda _: time.monotonic() < end, range(60))
                return counted([outcome(client, 5, read_registers(10 * a)) for a in addresses])
        for heard, seen in zip(range(2, 8), in_parallel(sixty_reads, range(2, 8))):
            print(f"\n  {heard} bytes of echo: {seen}", end="")
            with self.subTest(bytes_of_echo=heard):
                self.assertNotIn("03: wrong", seen)
                self.assertGreater(seen.get("good", 0), 30)

    def test_P8_a_glitch_behind_replies_does_not_cost_the_writes(self):
        def reads_and_writes(glitch):
            with odd_line(38400, [5], {5: f"post-{glitch}"}) as line, line.program.client() as client:
                seen = [outcome(client, 5, read_registers(0))]
                for turn in range(24):
                    seen.append(outcome(client, 5, every_kind_of_write(turn)))
                executed = len(line.zoo.writes())
            return counted(seen), executed
        for glitch, (seen, executed) in zip(("00", "FF"), in_parallel(reads_and_writes, ("00", "FF"))):
            print(f"\n  {glitch} behind each reply: {seen}, {executed} of 24 writes executed", end="")
            with self.subTest(glitch):
                self.assertEqual((list(seen), executed), (["good"], 24))


@unittest.skipIf(harness.SANITIZED, "a sanitizer takes the time that is measured here")
class Neighbours(unittest.TestCase):
    """One odd panel of five at 38400: what the four others lose by it. All habits in one run, one
    after the other, so that all meet the same machine."""
    ODD = 3
    # And the seconds that it rightly takes of a round.
    HABITS = {"excfn-84": 0, "padin2": 0,                   # T13
              "pad2": 0, "tail": 0.010,                     # T3
              "dup-5ms": 0.015,                             # T12
              "think-900ms": 0}                             # T1, T2

    LEARNING = 3  # s: until the habit is known, each frame that it hits costs a timeout

    def measure(self, line, seconds):
        since = time.monotonic() + self.LEARNING
        readers = asyncio.run(read_all(line.program.modbus_port(), range(1, 6),
                                       self.LEARNING + seconds))
        healthy = merged(r.summary(since) for unit, r in readers.items() if unit != self.ODD)
        wrong = sum(r.summary().wrong for r in readers.values())
        return healthy, wrong, seconds

    def test_P4_one_odd_panel_leaves_the_others_their_line(self):
        with odd_line(38400, zoo=("--think", "1")) as line:
            base, _, took = self.measure(line, 2)
        rate, round_time = base.good / took, 4 * took / base.good
        broken = []
        for habit, held in self.HABITS.items():
            for _ in range(2):  # what else the machine does can only make it worse
                with odd_line(38400, habits={self.ODD: habit}, zoo=("--think", "1")) as line:
                    seen, wrong, took = self.measure(line, 2.5)
                share = seen.good / took / rate * (round_time + held) / round_time
                slower = seen.quantile(0.9) / (base.quantile(0.9) + held)
                print(f"\n  {habit}: {share:.2f} of the rate, p90 {slower:.2f} times, refused "
                      f"{seen.refused}", end="")
                self.assertEqual(wrong, 0, habit)
                fine = share >= 0.6 and slower <= 3 and not seen.refused
                if fine:
                    break
            if not fine:
                broken.append(habit)
        self.assertEqual(broken, [])


if __name__ == "__main__":
    unittest.main()
