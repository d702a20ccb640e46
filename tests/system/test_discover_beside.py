"""Looking for unlisted stations while clients read without a pause: in real time what discovery_test.cpp has in
virtual time."""
import asyncio
import json
import tempfile
import unittest

import config
import harness
from test_discover import BAUD, PATH, state
from test_points import until
from zoo_line import Zoo, read_all


class Beside(unittest.TestCase):
    """Strangers that are slow, late or damaged, while two listed panels are read without a pause."""

    def test_P1_P4_strangers_cost_no_more_than_the_share_and_no_value_is_wrong(self):
        with tempfile.TemporaryDirectory() as folder:
            zoo = ["--baud", BAUD, "--bus", f"{folder}/tty=1,2,7,9,11,12", "--set", "9=think-700ms",
                   "--set", "11=crcbad", "--set", "12=think-80ms"]
            with Zoo(*zoo) as panels:
                line = config.line("zoo", panels.names[0], baud=BAUD, stations=config.station_ids([1, 2]))
                with harness.configured(config.gateway(line, http=config.ADMIN)) as program:
                    program.log.wait_for("line up")
                    self.look_beside(program)

    def look_beside(self, program):
        def read(seconds):
            readers = asyncio.run(read_all(program.modbus_port(), [1, 2], seconds))
            return [reader.summary() for reader in readers.values()]
        alone = read(4)
        self.assertEqual(program.rest("POST", PATH.format("zoo"), {"stations": "3-20"})[0], 202)
        beside = read(8)
        during = state(program, "zoo")
        until(lambda: state(program, "zoo")["state"] != "running", 120)
        report = state(program, "zoo")
        share = during["bus_ms"] / during["took_ms"]
        rates = sum(s.good for s in alone) / 4, sum(s.good for s in beside) / 8
        print(f"\n  {during['asked']} of {during['of']} addresses in {during['took_ms'] / 1000:.1f} s took "
              f"{100 * share:.1f} % of the line; {rates[0]:.0f} reads/s alone, {rates[1]:.0f} beside; found "
              f"{json.dumps([(s['id'], s['evidence']) for s in report['stations']])}", end="")
        self.assertEqual([s.wrong for s in alone + beside], [0] * 4)
        self.assertEqual([s.refused for s in beside], [{}] * 2)
        self.assertLess(share, 0.15)  # one long question at the end of the time is not yet paid for
        self.assertGreater(rates[1], 0.8 * rates[0])
        found = {one["id"]: one for one in report["stations"]}
        self.assertLessEqual({7, 11, 12}, set(found))
        self.assertEqual(found[11]["profiles"], [])
        self.assertLessEqual(set(found), {7, 9, 11, 12})


if __name__ == "__main__":
    unittest.main()
