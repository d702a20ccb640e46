"""A way to the panels that stalls and later delivers everything: no wrong value."""
import asyncio
import time
import unittest

from zoo_line import Reader, in_parallel, merged, odd_line, read_all

BAUD = 38400


class Stalls(unittest.TestCase):
    STALLS = (500, 1600, 2400, 3200, 4000)  # ms

    def read_through(self, how):
        """Stalls of each length, begun while reads go on; `how`: stall or sever."""
        units = [1, 2, 3]
        readers = {unit: Reader(unit) for unit in units}
        with odd_line(BAUD, units, {"all": "think-20ms"}, tcp=True) as line:
            async def stalls(_):
                for pause in self.STALLS:
                    await asyncio.sleep(0.8)
                    line.zoo.tell(f"{how} {pause}")
                    await asyncio.sleep(pause / 1000)
            # A panel that was silent for so long is asked again within 5.5 s.
            seconds = sum(self.STALLS) / 1000 + 0.8 * len(self.STALLS) + 5.5 + 2
            asyncio.run(read_all(line.program.modbus_port(), units, seconds, readers, stalls))
        end = time.monotonic()
        last = merged(r.summary(since=end - 1.5) for r in readers.values())
        return merged(r.summary() for r in readers.values()), last

    def test_P1_a_way_that_stalls_and_then_delivers_brings_no_wrong_value(self):
        for how, (seen, last) in zip(("stall", "sever"),
                                     in_parallel(self.read_through, ("stall", "sever"))):
            what = "acknowledged" if how == "stall" else "not acknowledged"
            print(f"\n  {what}: {seen.good} good, {seen.wrong} wrong, refused {seen.refused}", end="")
            with self.subTest(what):
                self.assertEqual(seen.wrong, 0)
                self.assertEqual(last.refused, {}, "at the end")
                self.assertGreater(last.good, 10, "at the end")


if __name__ == "__main__":
    unittest.main()
