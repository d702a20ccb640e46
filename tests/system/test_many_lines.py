"""32 lines in one process: what one of them does, the others do not notice."""
import unittest

from paced import PacedBus, lowest_of_three
import many_lines  # found by paced, in tests/bench


class ManyLines(PacedBus):
    def test_P7_a_mute_a_noisy_and_a_flapping_line_cost_the_others_nothing(self):
        def ratio():
            phases = many_lines.measure(self.tools, self.folder.name, [(), many_lines.ALL_BAD],
                                        seconds=2)
            print()
            many_lines.print_table(phases)
            good, beside = phases.values()
            self.assertEqual((good.failed, beside.failed), (0, 0))
            self.assertGreater(len(good.seconds), 1000)
            self.assertGreater(min(beside.noise), 0.9 * many_lines.NOISE)
            self.assertGreater(beside.discarded, 0.9 * many_lines.NOISE * beside.time)
            self.assertGreater(beside.reopens, 0.5 * many_lines.FLAPS * beside.time)
            return beside.summary()[1] / good.summary()[1]
        self.assertLessEqual(lowest_of_three(ratio, 1.1), 1.1)


if __name__ == "__main__":
    unittest.main()
