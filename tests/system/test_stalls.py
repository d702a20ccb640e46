"""A way to the panels that stalls and later delivers everything: no wrong value."""
import asyncio
import time
import unittest

import harness
from zoo_line import Reader, Summary, in_parallel, merged, odd_line, read_all

BAUD = 38400


def last_answers(reader):
    return Summary([asked for asked in reader.asked if asked.answered][-10:])


def is_well(reader):
    return last_answers(reader).good == 10


class Stalls(unittest.TestCase):
    STALLS = (500, 1600, 2400, 3200, 4000)  # ms

    def read_through(self, how):
        """Stalls of each length, begun while reads go on; `how`: stall or sever. Ends as soon as
        every panel is read well again, or after PATIENCE."""
        units = [1, 2, 3]
        readers = {unit: Reader(unit) for unit in units}
        with odd_line(BAUD, units, {"all": "think-20ms"}, tcp=True) as line:
            async def stalls(end):
                for pause in self.STALLS:
                    await asyncio.sleep(0.8)
                    line.zoo.tell(f"{how} {pause}")
                    await asyncio.sleep(pause / 1000)
                while time.monotonic() < end and not all(map(is_well, readers.values())):
                    await asyncio.sleep(0.05)
                for reader in readers.values():
                    reader.done = True
            seconds = sum(self.STALLS) / 1000 + 0.8 * len(self.STALLS) + harness.PATIENCE
            asyncio.run(read_all(line.program.modbus_port(), units, seconds, readers, stalls))
        return readers.values()

    def test_P1_a_way_that_stalls_and_then_delivers_brings_no_wrong_value(self):
        for how, readers in zip(("stall", "sever"),
                                in_parallel(self.read_through, ("stall", "sever"))):
            what = "acknowledged" if how == "stall" else "not acknowledged"
            seen = merged(reader.summary() for reader in readers)
            print(f"\n  {what}: {seen.good} good, {seen.wrong} wrong, refused {seen.refused}", end="")
            with self.subTest(what):
                self.assertEqual(seen.wrong, 0)
                self.assertEqual([last_answers(r).refused for r in readers], [{}, {}, {}], "at the end")
                self.assertEqual([last_answers(r).good for r in readers], [10, 10, 10], "at the end")


if __name__ == "__main__":
    unittest.main()
