#!/usr/bin/env python3
"""The bench's arithmetic and its tables, on figures that are made up."""
import json
import math
import pathlib
import sys
import unittest
import xml.etree.ElementTree

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from measures import cost, figures, plot, report  # noqa: E402
from measures.figures import Bar, Row  # noqa: E402

# Two transactions of 10 ms; the second request leaves 100 us late, and a third finds no silence.
LOG = """1.000000 1.002000 0 REQ 01 03
1.004000 1.008000 0 RSP 01 03
1.010100 1.012100 0 REQ 02 03
1.014100 1.018100 0 RSP 02 03
1.019100 1.021100 0 REQ 03 03
""".splitlines()
GAP = 0.002
BARS = [Bar("share", {"slow", "fast"}, least=0.9), Bar("time", {"slow"}, most=5)]
ROWS = [Row("share", "slow", "ours", 0.95, ""), Row("share", "fast", "ours", 0.89, ""),
        Row("share", "fast", "theirs", 0.5, "", {"errors": {"wrong": 1}}),
        Row("time", "slow", "ours", 4.0, "ms"), Row("time", "fast", "ours", 400.0, "ms")]


class Figures(unittest.TestCase):
    def test_a_quantile_lies_between_two_values(self):
        self.assertEqual(figures.quantile([3, 1, 2], 0.5), 2)
        self.assertAlmostEqual(figures.quantile([0, 10], 0.25), 2.5)
        self.assertEqual(figures.quantile([4], 0.99), 4)
        self.assertTrue(math.isnan(figures.quantile([], 0.5)))

    def test_a_rate_counts_whole_periods_of_requests(self):
        self.assertAlmostEqual(figures.rate(figures.parse_log(LOG)), 2 / 0.0191)
        self.assertTrue(math.isnan(figures.rate(figures.parse_log(LOG[:2]))))

    def test_a_request_that_nobody_heard_is_no_transaction(self):
        frames = figures.parse_log([*LOG, "1.5 1.6 0 DROP 08 03"])
        self.assertAlmostEqual(figures.rate(frames), 2 / 0.0191)

    def test_lateness_is_what_is_beyond_the_gap_and_below_0_where_it_is_cut_short(self):
        late = figures.lateness(figures.parse_log(LOG), GAP)
        self.assertEqual([round(1e6 * one) for one in late], [100, -1000])

    def test_only_frames_of_the_window_count(self):
        frames = figures.between(figures.parse_log(LOG), 1.004, 1.0141)
        self.assertEqual([frame.kind for frame in frames], ["RSP", "REQ"])

    def test_the_gap_is_the_standards(self):
        self.assertAlmostEqual(figures.standard_gap(9600), 3.5 * 11 / 9600)
        self.assertEqual(figures.standard_gap(115200), 1.75e-3)
        self.assertEqual(figures.standard_gap(0), 0)

    def test_growth_is_the_exponent(self):
        self.assertAlmostEqual(figures.growth([1, 10, 100], [3, 3, 3]), 0)
        self.assertAlmostEqual(figures.growth([1, 10, 100], [2, 20, 200]), 1)
        self.assertAlmostEqual(figures.growth([1, 2, 4], [5, 20, 80]), 2)

    def test_turns_become_their_median(self):
        turns = [Row("time", "slow", "ours", value, "ms") for value in (9.0, 1.0, 2.0)]
        only, other = figures.medians([*turns, ROWS[0]])
        self.assertEqual((only.value, only.detail["turns"]), (2.0, [9.0, 1.0, 2.0]))
        self.assertEqual(other, ROWS[0])

    def test_a_bar_is_for_its_cases_and_a_missing_figure_does_not_hold(self):
        self.assertEqual(figures.bar_of(BARS, ROWS[0]), BARS[0])
        self.assertIsNone(figures.bar_of(BARS, ROWS[4]))
        self.assertTrue(figures.holds(BARS[0], 0.9))
        self.assertFalse(figures.holds(BARS[0], 0.899))
        self.assertTrue(figures.holds(BARS[1], 5))
        self.assertFalse(figures.holds(BARS[1], math.nan))


class Cost(unittest.TestCase):
    def test_an_interval_holds_the_median_and_is_the_same_for_the_same_values(self):
        values = [i / 100 for i in range(-50, 51)]
        low, high = cost.interval(values)
        self.assertTrue(-0.2 < low < 0 < high < 0.2, (low, high))
        self.assertEqual(cost.interval(values), (low, high))

    def test_a_line_that_waits_for_its_master_is_less_used(self):
        gap = figures.standard_gap(cost.BAUD)
        def frames(late):
            times = [(i * (0.01 + gap + late), i * (0.01 + gap + late) + 0.01) for i in range(11)]
            return [frame for start, end in times for frame in
                    (figures.Frame(start, start + 0.004, "REQ"), figures.Frame(start + 0.005, end, "RSP"))]
        self.assertAlmostEqual(cost.utilisation(frames(0)), 1)
        self.assertAlmostEqual(cost.utilisation(frames(0.01 + gap)), 0.5)

    def test_pairs_are_judged_by_their_medians(self):
        pairs = [{cost.BARE: (100, 0.9), cost.LADEN: (102, 0.899)}] * 60
        (_, share, _, _), (_, lost, _, _) = cost.judged(pairs)
        self.assertAlmostEqual(share, 0.02)
        self.assertAlmostEqual(lost, 0.001)
        self.assertTrue(cost.is_narrow(pairs))


class Report(unittest.TestCase):
    def test_numbers_have_four_digits(self):
        shown = [report.number(value) for value in (0, 12345.6, 12.345, 0.99512, 741.26, math.nan)]
        self.assertEqual(shown, ["0", "12346", "12.35", "0.9951", "741.3", "-"])

    def test_a_table_judges_the_one_program_and_shows_the_others(self):
        text = report.measure_table("share", ROWS, BARS, "ours")
        self.assertIn("| case | ours | theirs | asked | holds |", text)
        self.assertIn("| slow | 0.9500 |  | >= 0.9 | yes |", text)
        self.assertIn("| fast | 0.8900 | 0.5000 (!) | >= 0.9 | **no** |", text)

    def test_a_bar_shows_its_worst_case(self):
        text = report.bars_table(ROWS, [*BARS, Bar("size", {"all"}, most=1)], "ours")
        self.assertIn("| share | 1 of 2 hold; worst fast | >= 0.9 | 0.8900 | **no** |", text)
        self.assertIn("| time | slow | <= 5 | 4.000 | yes |", text)
        self.assertIn("| size | all | <= 1 | not measured | |", text)

    def test_json_has_every_figure_and_null_for_what_is_none(self):
        lost = Row("time", "slow", "theirs", math.nan, "ms")
        text = report.as_json([*ROWS, lost], BARS, "a machine")
        read = json.loads(text)["figures"]
        self.assertEqual(len(read), 6)
        self.assertIsNone(read[-1]["value"])
        self.assertEqual(report.from_json(text)[:5], ROWS)
        self.assertEqual((read[1]["asked"], read[1]["holds"]), (">= 0.9", False))

    def test_a_new_figure_takes_the_place_of_the_old_one(self):
        again = ROWS[1]._replace(value=0.99)
        other = Row("size", "all", "ours", 5.0, "MiB")
        self.assertEqual(report.updated(ROWS, [other, again]),
                         [ROWS[0], again, *ROWS[2:], other])

    def test_a_plot_is_well_formed_and_shows_what_can_be_compared(self):
        root = xml.etree.ElementTree.fromstring(plot.svg(ROWS, BARS, "a < b"))
        words = [one.text for one in root.iter("{http://www.w3.org/2000/svg}text")]
        self.assertIn("share", words)
        self.assertIn("time (logarithmic)", words)
        self.assertIn("a < b", words)


if __name__ == "__main__":
    unittest.main()
