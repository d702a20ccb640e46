"""The way to the panels breaks or comes in pieces while replies are under way: no wrong value, and
nothing is executed after it was reported as failed."""
import itertools
import time
import unittest

from harness import read_registers, write_register
from zoo_line import WRITABLE, counted, in_parallel, odd_line, outcome

BAUD = 38400


def reads_until(client, unit, end, addresses):
    """[(address, outcome)] of one read after the other."""
    seen = []
    while time.monotonic() < end:
        address = next(addresses)
        seen.append((address, outcome(client, unit, read_registers(address))))
    return seen


def last_good(seen, count=10):
    return [what for _, what in seen[-count:]] == ["good"] * count


class Returns(unittest.TestCase):
    def ask_through_cuts(self, tcp):
        """The connection goes and comes back at once, five times; each time the reply that was
        under way is handed to the new one."""
        addresses = itertools.count(100)
        with odd_line(BAUD, [1], {1: "think-150ms"}, tcp=tcp) as line, \
                line.program.client() as client:
            seen = [(0, outcome(client, 1, read_registers(next(addresses))))]
            for _ in range(5):
                line.zoo.tell("cut")
                seen += reads_until(client, 1, time.monotonic() + 1.5, addresses)
            seen += reads_until(client, 1, time.monotonic() + 3, addresses)
        return seen

    def test_P1_a_reply_that_is_handed_to_the_next_connection_answers_nobody_else(self):
        for tcp, seen in zip((True, False), in_parallel(self.ask_through_cuts, (True, False))):
            what = "tcp" if tcp else "serial"
            print(f"\n  {what}, five times gone and back: {counted([o for _, o in seen])}", end="")
            with self.subTest(what):
                self.assertNotIn("03: wrong", counted([o for _, o in seen]))
                self.assertTrue(last_good(seen), seen[-10:])


class Refused(unittest.TestCase):
    def test_P2_what_was_never_delivered_is_not_executed_after_its_refusal(self):
        refused = {}
        with odd_line(BAUD, [1], {1: "think-2ms"}, tcp=True) as line, \
                line.program.client() as client:
            self.assertEqual(outcome(client, 1, read_registers(7)), "good")
            for turn, pause in enumerate((1500, 4000, 2500)):
                line.zoo.tell(f"sever {pause}")
                end, address = time.monotonic() + pause / 1000, WRITABLE + 100 * turn
                while time.monotonic() < end:
                    pdu = write_register(address, 1)
                    if outcome(client, 1, pdu) != "good":
                        refused[pdu] = time.monotonic()
                    address += 1
                while outcome(client, 1, read_registers(7)) != "good":
                    pass
            # Whatever the kernel still had is here by now: the reads went the same way.
            self.assertEqual(outcome(client, 1, read_registers(8)), "good")
            executed = line.zoo.writes()
        # The panel needs 2 ms and the wire 4 from the last byte on; a tenth of a timeout is allowed.
        late = [w.at - refused[w.pdu] for w in executed
                if w.pdu in refused and w.at > refused[w.pdu] + 0.05]
        print(f"\n  {len(refused)} writes refused, {len(late)} of them executed later", end="")
        self.assertGreater(len(refused), 2)
        self.assertEqual(late, [])


class Pieces(unittest.TestCase):
    def test_P1_holes_of_200_ms_inside_a_reply_are_waited_for(self):
        # One lost TCP segment is a hole of that length.
        def reads(habit):
            with odd_line(BAUD, [1], {1: habit}, tcp=True) as line, \
                    line.program.client() as client:
                return counted([outcome(client, 1, read_registers(50 * n, 100)) for n in range(12)])
        habits = ("split-30-60", "split-200-200")
        for habit, seen in zip(habits, in_parallel(reads, habits)):
            print(f"\n  {habit}: {seen}", end="")
            with self.subTest(habit):
                self.assertEqual(seen, {"good": 12})


if __name__ == "__main__":
    unittest.main()
