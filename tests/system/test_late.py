"""What one late, lost or unasked reply costs, afterwards and besides."""
import asyncio
import pathlib
import tempfile
import time
import unittest

import harness
from harness import read_registers, write_register
from zoo_line import WRITABLE, Client, merged, odd_line, outcome, read_all

BAUD = 38400
TIMEOUT = 0.5  # s: the default response_timeout
UNITS, ODD = range(1, 6), 3


async def silence_later(line, unit, end, after):
    """Loses one reply of a unit in the middle of it."""
    await asyncio.sleep(after)
    line.zoo.set(unit, "mute@=1")


class Late(unittest.TestCase):
    def test_P5_a_late_reply_of_long_ago_makes_no_lost_frame_stop_the_line(self):
        with odd_line(BAUD, [1, 2]) as line, line.program.client() as client:
            line.zoo.set(1, "think-2600ms@=1")
            self.assertEqual(outcome(client, 1, write_register(WRITABLE, 1)), "06: exception 0B")
            time.sleep(2.4)  # it comes, and nothing else is on the wire
            good = 0
            while good < 300:
                good += outcome(client, 1, read_registers(good)) == "good"
            readers = asyncio.run(read_all(line.program.modbus_port(), [1, 2], 5,
                                           beside=lambda end: silence_later(line, 1, end, 1)))
            other = readers[2].summary()
        print(f"\n  a frame is lost 300 good ones after one that was 2.1 s late: the other panel's "
              f"client waits at most {max(other.seconds):.2f} s", end="")
        self.assertEqual((other.wrong, other.refused), (0, {}))
        self.assertLess(max(other.seconds), 2.5 * TIMEOUT)


def requests_in(log):
    """[(start, end, kind, bytes)] of what was on the wire, in order."""
    frames = []
    for text in log.read_text().splitlines():
        start, end, _, kind, *data = text.split()
        frames.append((float(start), float(end), kind, bytes.fromhex("".join(data))))
    return sorted(frames)


async def one_connection(port, line):
    """A read whose first reply is lost, and behind it at once another of the same panel and ten of
    another panel."""
    client = await Client.connect(port)
    await client.ask(1, read_registers(1))
    await client.ask(2, read_registers(1))
    line.zoo.set(1, "mute@=1")
    asked = [client.send(1, read_registers(100)), client.send(1, read_registers(200))]
    asked += [client.send(2, read_registers(300 + 20 * n)) for n in range(10)]
    await asyncio.wait([a.done for a in asked])
    client.close()
    return asked


class Lost(unittest.TestCase):
    def test_P5_a_lost_frame_of_one_panel_leaves_the_wire_to_the_same_clients_other_requests(self):
        with tempfile.TemporaryDirectory() as folder:
            log = pathlib.Path(folder) / "wire.log"
            with odd_line(BAUD, [1, 2], zoo=("--log", log)) as line:
                asked = asyncio.run(one_connection(line.program.modbus_port(), line))
                frames = requests_in(log)
        self.assertTrue(all(a.is_good for a in asked))
        requests = [f for f in frames if f[2] == "REQ"]
        lost = next(i for i, f in enumerate(requests) if f[3][2:4] == b"\0\x64")
        # Between the first that was lost and the last of the other panel's: one timeout may pass.
        last = max(i for i, f in enumerate(requests) if f[3][0] == 2)
        idle = sorted(b[0] - a[1] for a, b in zip(requests[lost:last], requests[lost + 1:last + 1]))
        print(f"\n  idle between requests behind a lost frame: {idle[-1]:.3f} s, then {idle[-2]:.3f} s "
              f"at most", end="")
        self.assertLess(idle[-1], 1.2 * TIMEOUT)
        self.assertLess(idle[-2], 0.2 * TIMEOUT)


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
            with odd_line(BAUD, UNITS, {ODD: habit}) as line:
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
