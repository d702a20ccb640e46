"""What the promises P3, P4, P5, P6 and P9 come to on a paced line: one measurement a function.

All of them run the gateway on wire.Bus; times on the wire are those of the bus' own log.
"""
import asyncio
import itertools
import pathlib
import random
import statistics
import sys
import time
from collections import namedtuple

HERE = pathlib.Path(__file__).resolve()
sys.path.insert(0, str(HERE.parents[1] / "system"))
from clients import percentile, with_clients  # noqa: E402
from harness import PATIENCE, read_registers, write_register  # noqa: E402
from wire import BITS, FAULTS, Bus, wire_limit  # noqa: E402

Frame = namedtuple("Frame", "start end kind bytes")  # time.monotonic() of the first and last bit
REPLIES = ("RSP", "RSPX")


def frames(bus):
    """What was on the wire; of a bus that has ended, opened with log=True."""
    found = []
    for line in bus.log.finished_text().splitlines():
        start, end, _, kind, *data = line.split()
        if kind != "COLLISION":
            found.append(Frame(float(start), float(end), kind, bytes.fromhex("".join(data))))
    return sorted(found)


def silent_interval(baud):
    return 3.5 * BITS / baud if baud <= 19200 else 1.75e-3


def gaps_after(wire, is_before):
    """Seconds between the end of each such frame and the start of the request that came next."""
    return [b.start - a.end for a, b in itertools.pairwise(wire)
            if is_before(a) and b.kind not in REPLIES]


Answers = namedtuple("Answers", "asked unanswered strays closed lateness kinds")


def answers_under_faults(tools, folder, baud, seconds=4, deadline=1.5, clients=40, depth=4):
    """P3: every fault on, more requests than the line can take. `lateness`: of the latest answer,
    in seconds after its deadline; `strays`: answers that nobody waited for."""
    settings = {"timing": "{response_timeout: 100ms}",
                "queue": f"{{limit: 256, deadline: {round(deadline * 1000)}ms}}"}
    dice = random.Random(1)

    def request():
        unit, address = dice.randrange(1, 9), dice.randrange(2000)
        if dice.randrange(8) == 0:
            return unit, write_register(3000 + address, address)
        return unit, read_registers(address, 10)

    async def ask(all_clients):
        end = time.monotonic() + seconds
        done = asyncio.gather(*(c.ask_until(end, request, depth) for c in all_clients))
        try:
            await asyncio.wait_for(done, PATIENCE)
            # Answers come in order: a second answer to anything would come before these.
            last = asyncio.gather(*(c.ask(1, read_registers(0)) for c in all_clients))
            await asyncio.wait_for(last, PATIENCE)
        except asyncio.TimeoutError:
            pass  # it shows in `unanswered`
        return all_clients

    with Bus(tools, folder, baud, FAULTS, settings) as bus:
        seen = asyncio.run(with_clients(bus.gateway.modbus_port(), clients, ask))
    asked = [a for c in seen for a in c.asked]
    answered = [a for a in asked if a.reply]
    kinds = {}
    for a in answered:
        kinds[a.exception or "good"] = kinds.get(a.exception or "good", 0) + 1
    return Answers(len(asked), len(asked) - len(answered), sum(len(c.strays) for c in seen),
                   sum(c.closed for c in seen), max(a.seconds for a in answered) - deadline, kinds)


def back_after(tools, folder, baud, busy):
    """P4: seconds from the moment a dead station could answer again to the end of its answer, at
    worst: it comes back just after a probe. `busy`: seven clients keep the line full meanwhile."""
    settings = {"timing": "{response_timeout: 100ms}",
                "offline": "{probe_min: 500ms, probe_max: 1s}"}
    with Bus(tools, folder, baud, ["8:drop=1"], settings, log=True) as bus:
        with bus.gateway.client() as client:
            client.ask(1, read_registers(0))
            while "station offline" not in bus.gateway.log.text():
                client.ask(8, read_registers(0))
            load = None
            if busy:
                load = bus.start_load("--conns", 7, "--units", "1-7", "--time", PATIENCE)
            asked = bus.stats()["dropped"]
            bus.log.wait_for(r" DROP 08 ", asked + 2)  # the pause has grown to probe_max
            bus.tell("fault 8:")
            revived = time.monotonic()
            answer = bus.log.wait_for(r"^\S+ (\S+) \S+ RSP 08 ")
            bus.gateway.log.wait_for("station online")
            good = client.ask(8, read_registers(0))[0] == 3
            if load:
                load.terminate()
                load.communicate()
    assert good
    return float(answer.group(1)) - revived


Gaps = namedtuple("Gaps", "count shortest median longest")


def summary(gaps):
    return Gaps(len(gaps), min(gaps), statistics.median(gaps), max(gaps))


def gaps_behind_exceptions(tools, folder, baud, seconds=2):
    """P5: ({"reply" | "exception": Gaps}, bus statistics) while eight clients wait, every second
    reply being an exception."""
    with Bus(tools, folder, baud, [f"{i}:exc=2,excevery=2" for i in range(1, 9)], log=True) as bus:
        _, stats = bus.load("--conns", 8, "--units", "1-8", "--time", seconds, "--warm", 0)
    wire = frames(bus)
    return {"reply": summary(gaps_after(wire, lambda f: f.kind == "RSP" and f.bytes[1] < 0x80)),
            "exception": summary(gaps_after(wire, lambda f: f.kind == "RSP" and f.bytes[1] >= 0x80))
            }, stats


def gaps_behind_broadcasts(tools, folder, baud, seconds=2, turnaround=0.1):
    """P5: (Gaps behind broadcasts, bus statistics) while four readers and broadcasts wait."""
    settings = {"timing": f"{{broadcast_turnaround: {round(turnaround * 1000)}ms}}"}

    async def ask(clients):
        end = time.monotonic() + seconds
        work = [clients[0].ask_until(end, lambda: (0, write_register(4000, 7)), 2)]
        for i, client in enumerate(clients[1:], 1):
            work.append(client.ask_until(end, lambda unit=i: (unit, read_registers(100, 10))))
        await asyncio.gather(*work)

    with Bus(tools, folder, baud, settings=settings, log=True) as bus:
        asyncio.run(with_clients(bus.gateway.modbus_port(), 5, ask))
        stats = bus.stats()
    return summary(gaps_after(frames(bus), lambda f: f.kind == "BCAST")), stats


Reads = namedtuple("Reads", "answers_a_transaction registers_a_second")


def reads_of_one_station(tools, folder, baud, starts, seconds=2):
    """P6: one client for each start, that reads ten registers of station 1 from there. Station 1
    has shown before that it answers reads of 80 registers: else nothing is joined."""
    async def ask(clients):
        await clients[0].ask(1, read_registers(0, 80))
        begin = time.monotonic()
        await asyncio.gather(*(c.ask_until(begin + seconds, lambda a=s: (1, read_registers(a, 10)))
                               for c, s in zip(clients, starts)))
        return sum(len(c.asked) for c in clients), time.monotonic() - begin

    with Bus(tools, folder, baud) as bus:
        answers, took = asyncio.run(with_clients(bus.gateway.modbus_port(), len(starts), ask))
        replies = bus.stats()["replies"] - 1  # the one that showed the length
    return Reads(answers / replies, 10 * answers / took)


def _flood(client, end, dice):
    """Sixteen requests in flight that have nothing in common."""
    return client.ask_until(end, lambda: (1, read_registers(20 * dice.randrange(100), 10)), 16)


def _be_polite(client, end):
    return client.ask_until(end, lambda: (2, read_registers(100, 10)))


def polite_beside_a_flooder(tools, folder, baud, seconds=3):
    """P9: (p95 of a client that asks one at a time, in transaction times; its answers) while
    another one keeps sixteen requests in flight."""
    async def ask(clients):
        end = time.monotonic() + seconds
        await asyncio.gather(_flood(clients[0], end, random.Random(1)), _be_polite(clients[1], end))
        return clients[1].asked

    with Bus(tools, folder, baud) as bus:
        polite = asyncio.run(with_clients(bus.gateway.modbus_port(), 2, ask))
    return percentile([a.seconds for a in polite], 0.95) * wire_limit(baud), len(polite)


def writes_beside_readers(tools, folder, baud, seconds=2):
    """P9: for each write, beside the same two: the requests that started after it had been sent
    and before it started itself."""
    dice = random.Random(1)
    values = itertools.count(1)

    async def write(client, end):
        while time.monotonic() < end:
            await asyncio.sleep(dice.uniform(0, 4 / wire_limit(baud)))  # at any phase of the line
            await client.ask(3, write_register(5000, next(values)))
        return client.asked

    async def ask(clients):
        end = time.monotonic() + seconds
        return (await asyncio.gather(write(clients[2], end), _flood(clients[0], end, dice),
                                     _be_polite(clients[1], end)))[0]

    with Bus(tools, folder, baud, log=True) as bus:
        writes = asyncio.run(with_clients(bus.gateway.modbus_port(), 3, ask))
    requests = [f for f in frames(bus) if f.kind not in REPLIES]
    overtaken = []
    for asked in writes:
        own = next(f for f in requests if f.bytes[1:-2] == asked.pdu)
        overtaken.append(sum(asked.sent < f.start < own.start for f in requests))
    return overtaken
