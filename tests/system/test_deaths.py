"""The moment of dying, with all defaults: what the others' clients notice of it."""
import asyncio
import contextlib
import itertools
import time
import unittest

import harness
from harness import read_registers, write_register
from zoo_line import (WRITABLE, Client, Reader, Summary, in_parallel, merged, odd_line,
                      read_all)

BAUD = 38400
DYING = 3
UNITS = range(1, 6)
TIMEOUT = 0.5  # s: the default response_timeout


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
                return asyncio.run(scada(line, shares, 2, 8, 14))
        cases = {"five connections": [[unit] for unit in UNITS], "one connection": [list(UNITS)]}
        for what, seen in zip(cases, in_parallel(run, list(cases.values()))):
            with self.subTest(what):
                self.judge(what, *seen)

    def judge(self, what, reads, writes, revived):
        healthy = [a for a in reads if a.unit != DYING]
        longest = max(a.seconds for a in healthy + writes)
        slow = {unit: sum(a.seconds > 0.3 for a in healthy + writes if a.unit == unit)
                for unit in UNITS if unit != DYING}
        lost = sum(not a.is_good for a in writes)
        summary = Summary(healthy)
        back = min((a.answered - revived for a in reads
                    if a.unit == DYING and a.is_good and a.answered > revived), default=float("inf"))
        print(f"\n  {what}: longest wait {longest:.3f} s, answers over 300 ms {slow}, {lost} of "
              f"{len(writes)} writes lost, refused {summary.refused}, back after {back:.2f} s", end="")
        self.assertEqual((summary.wrong, summary.refused, lost), (0, {}, 0))
        self.assertLess(longest, 0.7)
        self.assertLessEqual(max(slow.values()), 1)
        self.assertLess(back, 5.5)

    def test_P4_a_write_to_a_dead_panel_costs_the_others_no_more_than_a_read(self):
        async def beside(port, pdus, end):
            client = await Client.connect(port)
            for pdu in pdus:
                if time.monotonic() >= end:
                    break
                await client.ask(DYING, pdu)
                await asyncio.sleep(0.1)
            client.close()

        def run(pdus):
            with odd_line(BAUD, UNITS) as line:
                port, others = line.program.modbus_port(), [u for u in UNITS if u != DYING]
                asyncio.run(read_all(port, UNITS, 0.5))  # its pace is known
                line.zoo.set(DYING, "dead")
                until_offline(line, DYING)
                readers = asyncio.run(read_all(
                    port, others, 8, beside=lambda end: beside(port, pdus, end)))
                return merged(r.summary() for r in readers.values())
        reads, writes = (run(pdus) for pdus in (
            (read_registers(n) for n in itertools.count()),
            (write_register(WRITABLE + n, n) for n in itertools.count())))
        print(f"\n  reads to the dead one: {reads.good} answers of the others, longest "
              f"{max(reads.seconds):.3f} s; writes: {writes.good}, {max(writes.seconds):.3f} s", end="")
        self.assertEqual((reads.wrong, writes.wrong, writes.refused), (0, 0, {}))
        self.assertGreater(writes.good, 0.95 * reads.good)
        self.assertLess(max(writes.seconds), max(1.5 * max(reads.seconds), 0.3 * TIMEOUT))


def until_offline(line, *units):
    """Reads until all of them are."""
    with contextlib.ExitStack() as stack:
        clients = [(unit, stack.enter_context(line.program.client())) for unit in units]
        while line.program.log.text().count("station offline") < len(units):
            for unit, client in clients:
                client.send(unit, read_registers(0))
            for _, client in clients:
                client.receive()


@unittest.skipIf(harness.SANITIZED, "a sanitizer takes the time that is measured here")
class ManyOfMany(unittest.TestCase):
    def test_P4_ten_of_twenty_that_die_at_once_leave_the_wire_to_the_others(self):
        units = range(1, 21)
        with odd_line(BAUD, units) as line:
            readers = {unit: Reader(unit) for unit in units}
            died = [0.0]

            async def kill(end):
                await asyncio.sleep(3)
                for unit in range(11, 21):
                    line.zoo.set(unit, "dead")
                died[0] = time.monotonic()
            asyncio.run(read_all(line.program.modbus_port(), units, 13, readers, kill))
        rate_before = sum(sum(a.sent > died[0] - 2 and a.answered < died[0] and a.is_good
                              for a in r.asked) for r in readers.values()) / 2
        since = died[0] + 3
        after = merged(readers[unit].summary(since) for unit in range(1, 11))
        last = max(a.answered for unit in range(1, 11) for a in readers[unit].asked)
        share = after.good / (last - since) / rate_before
        print(f"\n  from 3 s after the death on the healthy ten have {share:.3f} of the wire, refused "
              f"{after.refused}", end="")
        self.assertEqual((after.wrong, after.refused), (0, {}))
        self.assertGreater(share, 0.9)

    def test_P4_ten_dead_panels_that_are_written_cyclically_leave_the_wire_to_eight_readers(self):
        healthy, dead = range(1, 9), range(11, 21)

        async def write_cyclically(port, end):
            client = await Client.connect(port)
            for turn in itertools.count():
                if time.monotonic() >= end:
                    break
                await client.ask(dead[turn % len(dead)], write_register(WRITABLE, turn))
                await asyncio.sleep(0.02)
            client.close()
        with odd_line(BAUD, [*healthy, *dead]) as line:
            port = line.program.modbus_port()
            base = asyncio.run(read_all(port, healthy, 3))
            for unit in dead:
                line.zoo.set(unit, "dead")
            until_offline(line, *dead)
            seen = asyncio.run(read_all(port, healthy, 8,
                                        beside=lambda end: write_cyclically(port, end)))
        rates = [merged(r.summary() for r in readers.values()).good / seconds
                 for readers, seconds in ((base, 3), (seen, 8))]
        print(f"\n  beside writes to ten dead ones: {rates[1] / rates[0]:.3f} of the rate", end="")
        self.assertGreater(rates[1], 0.95 * rates[0])


@unittest.skipIf(harness.SANITIZED, "a sanitizer takes the time that is measured here")
class Broadcasts(unittest.TestCase):
    def test_P4_a_panel_that_answers_broadcasts_costs_nobody_more_than_a_gap(self):
        async def broadcast(port, end):
            client = await Client.connect(port)
            while time.monotonic() < end:
                await asyncio.sleep(0.4)
                await client.ask(0, write_register(WRITABLE, 1))
            client.close()

        def run(habit):
            with odd_line(BAUD, UNITS, {DYING: habit}) as line:
                port = line.program.modbus_port()
                readers = asyncio.run(read_all(port, UNITS, 6,
                                               beside=lambda end: broadcast(port, end)))
            return merged(r.summary() for r in readers.values())
        plain, odd = run("-"), run("bcast-reply")
        longest = max(odd.seconds) / max(plain.seconds)
        print(f"\n  {odd.good / plain.good:.3f} of the rate beside broadcasts that nobody answers, "
              f"longest wait {longest:.2f} times", end="")
        self.assertEqual((odd.wrong, odd.refused), (0, {}))
        self.assertGreater(odd.good, 0.95 * plain.good)
        self.assertLess(longest, 1.5)


if __name__ == "__main__":
    unittest.main()
