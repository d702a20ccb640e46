"""The promises on a paced line, against an independent bus (skipped where its source is not there)."""
import unittest

from paced import PacedBus, best_of_three, wire


class Wire(PacedBus):
    def test_P1_no_wrong_value_with_every_fault_on(self):
        good, wrong, violations = wire.under_faults(self.tools, self.folder.name, 38400)
        print(f"\n  {good} good answers, {wrong} wrong values, {violations} gap violations")
        self.assertGreater(good, 100)
        self.assertEqual(wrong, 0)
        self.assertEqual(violations, 0)

    def test_P4_one_dead_panel_leaves_the_line_to_the_others(self):
        share, p99 = best_of_three(lambda: wire.with_dead(self.tools, self.folder.name, 19200, 1), 0.95)
        print(f"\n  {share:.3f} of the limit, p99 of an offline answer {p99:.1f} ms")
        self.assertGreaterEqual(share, 0.95)
        self.assertLess(p99, 10)

    def test_P5_the_wire_never_idles_and_no_gap_is_broken(self):
        for baud, least, echo in ((9600, 0.99, 0), (38400, 0.975, 0), (38400, 0.975, 1)):
            def measure(rate=baud, echo=echo):
                return wire.utilisation(self.tools, self.folder.name, rate, echo=echo)
            share, violations, collisions = best_of_three(measure, least)
            print(f"\n  {baud}{' with echo' if echo else ''}: {share:.3f} of the limit")
            self.assertGreaterEqual(share, least)
            self.assertEqual((violations, collisions), (0, 0))

    def test_P8_no_wrong_value_on_an_adapter_that_hears_itself_badly(self):
        # Every fifth echo is damaged: a collision, and the read goes again.
        with wire.Bus(self.tools, self.folder.name, 38400, echo=2) as bus:
            seen, stats = bus.load("--conns", 8, "--units", "1-8", "--time", 4, "--warm", 0)
        self.assertEqual((wire.wrong_values(seen), stats["gap_violations"]), (0, 0))
        self.assertGreater(seen["all"]["ok"], 10)

    def test_P6_many_equal_readers_cost_as_one(self):
        times, answers = wire.shared(self.tools, self.folder.name, 9600, 64)
        print(f"\n  {times:.1f} times the limit, {answers:.1f} answers a transaction")
        self.assertGreaterEqual(times, 40)


if __name__ == "__main__":
    unittest.main()
