"""Many who ask at once: nobody is refused, nobody waits for ever, values are right."""
import asyncio
import itertools
import pathlib
import random
import tempfile
import time
import unittest

import harness
from harness import read_registers
from test_late import requests_in
from zoo_line import (Client, Reader, Summary, every_kind_of_write, odd_line, percentile,
                      with_clients)

BAUD = 38400
UNITS = range(1, 6)
FLOODERS = "127.0.0.2"  # their address


def equal_reads(port, connections, each):
    """[Asked] of one and the same read, all sent before any is answered."""
    async def ask(clients):
        asked = [c.send(1, read_registers(100, 10)) for c in clients for _ in range(each)]
        await asyncio.wait([a.done for a in asked], timeout=harness.PATIENCE)
        return asked
    return asyncio.run(with_clients(port, connections, ask))


class Equal(unittest.TestCase):
    def test_P6_P9_1024_equal_reads_at_once_are_all_answered_with_values(self):
        for connections in (16, 128, 512):
            with self.subTest(connections=connections), odd_line(BAUD) as line:
                asked = equal_reads(line.program.modbus_port(), connections, 1024 // connections)
                seen = Summary([a for a in asked if a.answered])
                frames = line.zoo.stats()["requests"]
                print(f"\n  {connections} connections: {seen.good} values, refused {seen.refused}, "
                      f"{frames} transactions", end="")
                self.assertEqual((seen.good, seen.wrong, seen.refused), (1024, 0, {}))

    def test_P9_30_pipelined_reads_of_one_connection_are_all_answered_with_values(self):
        async def ask(clients):
            asked = [clients[0].send(1 + n % 5, read_registers(20 * n, 10)) for n in range(30)]
            await asyncio.wait([a.done for a in asked], timeout=harness.PATIENCE)
            return asked
        with odd_line(BAUD) as line:
            seen = Summary(asyncio.run(with_clients(line.program.modbus_port(), 1, ask)))
        self.assertEqual((seen.good, seen.wrong, seen.refused), (30, 0, {}))


class Writers(unittest.TestCase):
    def test_P9_a_reader_beside_endless_writes_has_every_fifth_transaction(self):
        async def ask(clients):
            turns, end = itertools.count(), time.monotonic() + 4
            reader = Reader(1)
            writing = [c.ask_until(end, lambda: (2, every_kind_of_write(next(turns))), 16)
                       for c in clients[1:]]
            await asyncio.gather(reader.read_until(clients[0], end), *writing)
            return reader.asked
        with tempfile.TemporaryDirectory() as folder:
            log = pathlib.Path(folder) / "wire.log"
            with odd_line(BAUD, [1, 2], zoo=("--log", log)) as line:
                reads = asyncio.run(with_clients(line.program.modbus_port(), 4, ask))
                frames = [f for f in requests_in(log) if f[2] == "REQ"]
        overtaken = []
        for asked in reads:
            own = next(f[0] for f in frames if f[0] > asked.sent and f[3][1:-2] == asked.pdu)
            overtaken.append(sum(asked.sent < f[0] < own for f in frames))
        seen = Summary(reads)
        print(f"\n  {seen.good} reads beside {len(frames) - len(reads)} writes, at most "
              f"{max(overtaken)} before one", end="")
        self.assertEqual((seen.wrong, seen.refused), (0, {}))
        self.assertGreater(len(frames), 3 * len(reads))  # the writes were endless
        # One more may begin while the read is on its way.
        self.assertLessEqual(percentile(overtaken, 0.5), 4)
        self.assertLessEqual(max(overtaken), 5)


@unittest.skipIf(harness.SANITIZED, "a sanitizer takes the time that is measured here")
class Floods(unittest.TestCase):
    def flooded(self, own_address):
        """[Asked] of a polite client beside forty that flood from one address."""
        async def run(port):
            end = time.monotonic() + 5
            dice, turns = random.Random(1), itertools.count()
            flooding = [await Client.connect(port, FLOODERS) for _ in range(40)]
            polite = await Client.connect(port, own_address)
            floods = [c.ask_until(end, lambda: (dice.choice(UNITS),
                                                read_registers(dice.randrange(2000), 10)), 16)
                      for c in flooding]
            requests = ((1 + n % 5, every_kind_of_write(n // 4)) if n % 4 == 3 else
                        (1 + n % 5, read_registers(30 * n % 2000, 10)) for n in turns)
            await asyncio.gather(*floods, polite.ask_until(end, lambda: next(requests)))
            for client in [polite, *flooding]:
                client.close()
            return polite.asked, [a for c in flooding for a in c.asked]
        with odd_line(BAUD) as line:
            return asyncio.run(run(line.program.modbus_port()))

    def test_P9_a_polite_client_beside_forty_that_flood_is_always_answered_with_values(self):
        for own_address in ("127.0.0.1", "127.0.0.3"):
            with self.subTest(own_address):
                asked, floods = self.flooded(own_address)
                seen, theirs = Summary(asked), Summary(floods)
                print(f"\n  {own_address}: {seen.good} of {len(asked)}, refused {seen.refused}, p95 "
                      f"{percentile(seen.seconds, 0.95):.3f} s; the flooders': {theirs.good} good, "
                      f"refused {theirs.refused}", end="")
                self.assertEqual((seen.wrong, seen.refused), (0, {}))
                self.assertEqual(theirs.wrong, 0)
                self.assertGreater(seen.good, 20)


if __name__ == "__main__":
    unittest.main()
