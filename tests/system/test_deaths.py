"""The moment of dying, with all defaults: what the others' clients notice of it."""
import asyncio
import itertools
import time
import unittest

import harness
from harness import write_register
from zoo_line import (WRITABLE, Client, Reader, Summary, in_parallel, merged, odd_line,
                      read_all)

BAUD = 38400
DYING = 3
UNITS = range(1, 6)
TIMEOUT = 0.5  # s: the default response_timeout
# It is offline after three silent transactions, the first of which has two retries: each silence is
# waited for, and costs each of the others one slow answer (T1).
SILENCES = 5
# Offline stations have 3 % of the time: one alone is probed this often.
PROBES = TIMEOUT / 0.03


async def die_and_return(line, death, back):
    """The moment of its return."""
    await asyncio.sleep(death)
    line.zoo.set(DYING, "dead")
    await asyncio.sleep(back - death)
    line.zoo.set(DYING, "-")
    return time.monotonic()


async def write_now_and_then(port, unit, end):
    """Writes that must all be confirmed: [Asked]."""
    client = await Client.connect(port)
    asked = []
    while time.monotonic() < end:
        asked.append(await client.ask(unit, write_register(WRITABLE + len(asked), len(asked))))
        await asyncio.sleep(0.25)
    client.close()
    return asked


async def poll_all(port, units, end, dice):
    """One connection that asks one panel after the other."""
    client = await Client.connect(port)
    asked = []
    for unit in itertools.cycle(units):
        if time.monotonic() >= end:
            break
        asked.append(await client.ask(unit, dice[unit].request()))
        await asyncio.sleep(0.01)
    client.close()
    return asked


async def scada(line, shares, death, back, seconds):
    """`shares`: the units of each connection. ([Asked] of reads, of writes, moment of the return)"""
    port, end = line.program.modbus_port(), time.monotonic() + seconds
    dice = {unit: Reader(unit) for unit in UNITS}
    polls = [poll_all(port, units, end, dice) for units in shares]
    writes = [write_now_and_then(port, unit, end) for unit in UNITS if unit != DYING]
    *parts, revived = await asyncio.gather(*polls, *writes, die_and_return(line, death, back))
    reads, writes = parts[:len(polls)], parts[len(polls):]
    return list(itertools.chain(*reads)), list(itertools.chain(*writes)), revived


@unittest.skipIf(harness.SANITIZED, "a sanitizer takes the time that is measured here")
class OneOfFive(unittest.TestCase):
    def test_P4_a_panel_that_dies_and_returns_is_hardly_noticed_by_the_others(self):
        def run(shares):
            with odd_line(BAUD, UNITS) as line:
                return asyncio.run(scada(line, shares, 2, 8, 8 + PROBES + 3))
        cases = {"five connections": [[unit] for unit in UNITS], "one connection": [list(UNITS)]}
        for what, seen in zip(cases, in_parallel(run, list(cases.values()))):
            with self.subTest(what):
                self.judge(what, *seen)

    def judge(self, what, reads, writes, revived):
        healthy = [a for a in reads if a.unit != DYING]
        longest = max(a.seconds for a in healthy + writes)
        slow = {unit: max(sum(a.seconds > 0.3 for a in asked if a.unit == unit)
                          for asked in (healthy, writes))  # of one client
                for unit in UNITS if unit != DYING}
        lost = sum(not a.is_good for a in writes)
        summary = Summary(healthy)
        back = min((a.answered - revived for a in reads
                    if a.unit == DYING and a.is_good and a.answered > revived), default=float("inf"))
        print(f"\n  {what}: longest wait {longest:.3f} s, answers over 300 ms {slow}, {lost} of "
              f"{len(writes)} writes lost, refused {summary.refused}, back after {back:.2f} s", end="")
        self.assertEqual((summary.wrong, summary.refused, lost), (0, {}, 0))
        self.assertLess(longest, 0.7)
        self.assertLessEqual(max(slow.values()), SILENCES)
        self.assertLess(back, 1.1 * PROBES)


@unittest.skipIf(harness.SANITIZED, "a sanitizer takes the time that is measured here")
class ManyOfMany(unittest.TestCase):
    def test_P4_ten_of_twenty_that_die_at_once_leave_the_wire_to_the_others(self):
        """Each silence is waited for (T1): the ten cost their first silences, the retries of the two that fell silent
        first, and those while nobody has answered for 5 s; then a fifth of the wire together."""
        units, dying = range(1, 21), range(11, 21)
        outage = (len(dying) + 5) * (TIMEOUT + 0.05)
        with odd_line(BAUD, units) as line:
            readers = {unit: Reader(unit) for unit in units}
            died = [0.0]

            async def kill(end):
                await asyncio.sleep(3)
                for unit in dying:
                    line.zoo.set(unit, "dead")
                died[0] = time.monotonic()
            asyncio.run(read_all(line.program.modbus_port(), units, 18, readers, kill))
        rate_before = sum(sum(a.sent > died[0] - 2 and a.answered < died[0] and a.is_good
                              for a in r.asked) for r in readers.values()) / 2
        healthy = [reader for unit, reader in readers.items() if unit not in dying]
        refused = sum(merged(r.summary(died[0]) for r in healthy).refused.values())
        since = died[0] + outage
        after = merged(r.summary(since) for r in healthy)
        last = max(a.answered for r in healthy for a in r.asked)
        share = after.good / (last - since) / rate_before
        print(f"\n  from {outage:.1f} s after the death on the healthy ten have {share:.3f} of the wire, "
              f"refused {after.refused}, before {refused}", end="")
        self.assertEqual((after.wrong, after.refused), (0, {}))
        self.assertGreater(share, 0.75)
        # A request waits for its deadline of 2 s at most, and is answered 06.
        self.assertLessEqual(refused, len(healthy) * outage / 2)


if __name__ == "__main__":
    unittest.main()
