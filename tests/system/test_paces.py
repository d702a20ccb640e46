"""Quick and slow panels, mixed and changing, at several rates: everything that answers is heard."""
import itertools
import random
import struct
import time
import unittest

from harness import read_registers
from zoo_line import WRITABLE, counted, every_kind_of_write, in_parallel, odd_line, outcome

RATES = (9600, 38400, 115200)


class Paces(unittest.TestCase):
    def run_mix(self, habits, reads, seconds=4, **options):
        """What came of reads and writes, all stations at once."""
        units = [unit for unit in habits if unit != "all"] or [1, 2, 3]

        def ask_one(line, unit):
            dice, seen, turn = random.Random(unit), [], 0
            end = time.monotonic() + seconds
            with line.program.client() as client:
                while time.monotonic() < end:
                    for _ in range(reads):
                        seen.append(outcome(client, unit, read_registers(dice.randrange(2000), 10)))
                    for _ in range(4):
                        seen.append(outcome(client, unit, every_kind_of_write(turn)))
                        turn += 1
            return seen
        with odd_line(units=units, habits=habits, **options) as line:
            parts = in_parallel(lambda unit: ask_one(line, unit), units)
        return counted(list(itertools.chain(*parts)))

    def expect_good(self, seen, what):
        print(f"\n  {what}: {seen}", end="")
        with self.subTest(what):
            self.assertEqual(list(seen), ["good"])
            self.assertGreater(seen["good"], 20)

    def test_P1_quick_and_slow_panels_on_one_line_are_all_heard(self):
        habits = {1: "think-0.2ms", 2: "think-5ms", 3: "think-0.5ms", 4: "think-80ms", 5: "think-1ms",
                  6: "think-rand-0.2-80"}

        def run(baud):
            return self.run_mix(habits, reads=6, seconds=6, baud=baud)
        for baud, seen in zip(RATES, in_parallel(run, RATES)):
            self.expect_good(seen, f"{baud}, 0.2 to 80 ms")

    def test_P1_a_panel_that_becomes_quick_is_heard_as_before(self):
        def run(baud):
            habits = {unit: "think-0.2ms,think-12ms@=8" for unit in (1, 2)}
            return self.run_mix(habits, reads=6, seconds=3, baud=baud)
        for baud, seen in zip(RATES, in_parallel(run, RATES)):
            self.expect_good(seen, f"{baud}, 12 ms, then 0.2 ms")

    def test_P1_a_device_server_that_is_quicker_than_the_line_is_said_to_be_is_heard(self):
        habits = {1: "think-3ms,think-12ms@=4", 2: "think-0.2ms,think-12ms@=4"}
        seen = self.run_mix(habits, reads=6, seconds=2, baud=19200, wire_baud=0, tcp=True)
        self.expect_good(seen, "tcp, 12 ms, then 0.2 to 3 ms")

    def test_P1_a_clock_that_is_one_percent_fast_loses_no_write(self):
        # 255 bytes: they have left 2.6 ms before the gateway's own clock says so.
        pdu = struct.pack(">BHHB", 16, WRITABLE, 123, 246) + bytes(246)
        with odd_line(9600, [1], {1: "think-0.5ms"}, wire_baud=9696) as line, \
                line.program.client() as client:
            seen = counted([outcome(client, 1, read_registers(n)) for n in range(6)]
                           + [outcome(client, 1, pdu) for _ in range(8)])
            executed = len(line.zoo.writes())
        print(f"\n  9600, 1 % fast: {seen}, {executed} of 8 writes executed", end="")
        self.assertEqual((seen, executed), ({"good": 14}, 8))


if __name__ == "__main__":
    unittest.main()
