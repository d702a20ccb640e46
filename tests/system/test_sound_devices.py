"""Devices without a fault that are unlike a paced panel with changing values: each of their answers
is taken, each request is on the wire once, and no answer waits for a doubt (docs/how/threats.md)."""
import contextlib
import struct
import time
import unittest

import config
import harness
from harness import read_registers, write_register
from sound_line import DeviceServer, fault, line_of, reading
from zoo_line import in_parallel

TIMEOUT = 0.5  # s: the default response_timeout
AT_ONCE = TIMEOUT / 2  # more than a busy machine takes, less than any wait for a second answer


class Memory:
    """A device whose registers and coils keep what is written; a command register reads 0 directly
    after each write. Answers at once."""
    COMMAND = 500

    def __init__(self):
        self._cells = {}

    def __call__(self, frame, *_):
        pdu = frame[1:-2]
        function, address, value = struct.unpack(">BHH", pdu[:5])
        if function <= 4:
            return reading(pdu, lambda at: self._cells.get((function, at), 0))
        table = 1 if function in (5, 15) else 3
        if function in (5, 6):
            values = [value]
        elif function == 15:
            values = [pdu[6 + i // 8] >> i % 8 & 1 for i in range(value)]
        else:
            values = struct.unpack(f">{value}H", pdu[6:])
        self._cells.update({(table, address + i): v for i, v in enumerate(values)})
        self._cells.pop((3, self.COMMAND), None)
        return pdu[:5]


class Pausing:
    """A device that ignores a request within `deaf` seconds after its own reply, as its manual
    says (T14)."""
    THINK = 0.02

    def __init__(self, deaf, value):
        self._deaf, self._value = deaf, value
        self._replied = float("-inf")

    def __call__(self, frame):
        if time.monotonic() - self._replied < self._deaf:
            return None
        time.sleep(self.THINK)
        self._replied = time.monotonic()
        return reading(frame[1:-2], self._value)


class EqualValues(unittest.TestCase):
    """That an answer equals an earlier answer is no sign of anything: all alarms are off, an
    inverter sleeps, all setpoints are equal."""
    SECONDS = 8

    def poll(self, deaf, period, function, value):
        """(answered, asked, frames): a read each `period` of another place each time."""
        panel = Pausing(deaf, value)
        count = 16 if function <= 2 else 2
        with line_of({1: panel}, "{id: 1, name: inverter}") as (program, bus), \
                program.client() as client:
            replies = []
            for turn in range(int(self.SECONDS / period)):
                replies.append(client.ask(1, read_registers(20 * (turn % 5), count, function)))
                time.sleep(period)
            return sum(r[0] == function for r in replies), len(replies), len(bus.frames(1))

    def test_a_device_that_needs_a_pause_is_read_each_time_whatever_its_values_are(self):
        moving = iter(range(1 << 30))
        cases = {"registers that are all 0": (0.05, 0.4, 3, lambda at: 0),
                 "input registers that are all 25": (0.1, 0.4, 4, lambda at: 25),
                 "coils that are all off": (0.05, 0.4, 1, lambda at: 0),
                 "inputs that are all on": (0.1, 0.4, 2, lambda at: 1),
                 "registers that are all 0, asked each second": (0.85, 1.0, 3, lambda at: 0),
                 "changing registers": (0.05, 0.4, 3, lambda at: next(moving) & 0xFFFF)}
        results = in_parallel(lambda case: self.poll(*case), list(cases.values()))
        for name, (answered, asked, frames) in zip(cases, results):
            print(f"\n  {name}: {answered} of {asked} answered, {frames} frames", end="")
        for name, (answered, asked, frames) in zip(cases, results):
            with self.subTest(name):
                self.assertEqual(answered, asked)
                self.assertEqual(frames, asked)


class QuickDevices(unittest.TestCase):
    """An answer that comes before the computed end of its request is an answer: nothing is too
    early (T7)."""
    TURNS = 20

    @contextlib.contextmanager
    def quick(self, kind):
        """(program, frames): a device that answers at once, on a line configured for 9600 baud."""
        listed = "{id: 1, name: press}"
        if kind == "pseudo-terminal":
            with line_of({1: Memory()}, listed) as (program, bus):
                yield program, lambda: [f.bytes for f in bus.frames(1)]
        else:
            with DeviceServer(Memory()) as server:
                text = config.gateway(config.line(device=server.device, stations=listed, baud=9600,
                                                  echo="off"))
                with harness.configured(text) as program:
                    program.log.wait_for("line up")
                    yield program, server.frames

    def ask_each_once(self, frames, client, asked):
        """asked: [(pdu, wanted reply)]; all frames that came of them, and the longest wait."""
        before, longest = len(frames()), 0
        for pdu, wanted in asked:
            start = time.monotonic()
            self.assertEqual(client.ask(1, pdu), wanted, pdu.hex(" "))
            longest = max(longest, time.monotonic() - start)
        self.assertEqual(frames()[before:], [harness.rtu(1, pdu) for pdu, _ in asked])
        self.assertLess(longest, AT_ONCE)

    def test_each_read_and_each_write_is_on_the_wire_once(self):
        writes = [(lambda n: write_register(100 + n % 5, 4000 + n)),
                  (lambda n: write_register(110, 7)),  # the same setpoint again and again
                  (lambda n: struct.pack(">BHHBHH", 16, 120 + n, 2, 4, n, 0)),
                  (lambda n: struct.pack(">BHH", 5, n % 3, 0xFF00 * (n % 2))),
                  (lambda n: struct.pack(">BHHBB", 15, 40, 8, 1, n))]
        for kind in ("pseudo-terminal", "device server"):
            with self.quick(kind) as (program, frames), program.client() as client:
                reads = [(read_registers(n, 2), bytes([3, 4, 0, 0, 0, 0])) for n in range(self.TURNS)]
                with self.subTest(f"{kind}: 03"):
                    self.ask_each_once(frames, client, reads)
                for write in writes:
                    pdus = [write(n) for n in range(self.TURNS)]
                    with self.subTest(f"{kind}: {write(0).hex()}"):
                        self.ask_each_once(frames, client, [(pdu, pdu[:5]) for pdu in pdus])
                with self.subTest(f"{kind}: what was written"):
                    self.assertEqual(client.ask(1, read_registers(104, 1)), bytes([3, 2, 0x0F, 0xB3]))

    def test_a_command_register_that_resets_itself_is_confirmed_at_once(self):
        start = write_register(Memory.COMMAND, 1)
        state = read_registers(Memory.COMMAND, 1)
        for kind in ("pseudo-terminal", "device server"):
            with self.subTest(kind), self.quick(kind) as (program, frames), \
                    program.client() as client:
                self.ask_each_once(frames, client, [(start, start)] * self.TURNS)
                self.ask_each_once(frames, client, [(start, start), (state, b"\x03\x02\0\0")] * 5)


class Exceptions(unittest.TestCase):
    """An exception is the device's final answer: passed on unchanged and at once, and never asked
    for again (T10)."""
    CODES = (1, 2, 3, 4, 5, 6, 7, 8, 0x0A, 0x0B, 0x11, 0x40, 0x80, 0xE0, 0xFF)  # from 11h on: makers'
    ASKED = {3: read_registers(7, 2), 1: read_registers(7, 9, 1), 6: write_register(7, 1),
             16: struct.pack(">BHHBH", 16, 7, 1, 2, 5), 20: bytes([20, 7, 6, 0, 1, 0, 0, 0, 1])}

    def test_each_exception_is_passed_on_at_once_and_its_request_is_on_the_wire_once(self):
        cases = [(function, code) for function in self.ASKED for code in self.CODES]
        panels = {station: (lambda frame, code=code: fault(frame[1], code))
                  for station, (_, code) in enumerate(cases, 1)}
        with line_of(panels) as (program, bus), program.client() as client:
            for station, (function, code) in enumerate(cases, 1):
                with self.subTest(function=function, code=f"{code:02X}"):
                    start = time.monotonic()
                    self.assertEqual(client.ask(station, self.ASKED[function]), fault(function, code))
                    self.assertLess(time.monotonic() - start, AT_ONCE)
                    self.assertEqual([f.bytes for f in bus.frames(station)],
                                     [harness.rtu(station, self.ASKED[function])])

    def test_a_device_that_was_busy_once_refuses_another_function_finally(self):
        refusals = {16: 6, 20: 8, 3: 2, 6: 0xE0}
        with line_of({17: lambda frame: fault(frame[1], refusals[frame[1]])},
                     timing="{response_timeout: 300ms}") as (program, bus), \
                program.client() as client:
            for function, code in refusals.items():
                with self.subTest(function=function):
                    self.assertEqual(client.ask(17, self.ASKED[function]), fault(function, code))
                    sent = [f for f in bus.frames(17) if f.bytes[1] == function]
                    self.assertEqual(len(sent), 1)

    def test_an_exception_that_is_the_same_each_time_is_asked_for_once_each_time(self):
        with line_of({1: lambda frame: fault(frame[1], 2)}) as (program, bus), \
                program.client() as client:
            for turn in range(20):
                self.assertEqual(client.ask(1, read_registers(turn)), fault(3, 2))
            self.assertEqual(len(bus.frames(1)), 20)


class Unlisted(unittest.TestCase):
    def test_a_device_that_nobody_listed_is_waited_for_as_long_as_response_timeout(self):
        """T1, beside a quick panel whose pace is known."""
        thinks = {22: 0.03, 24: 0.15, 26: 0.3}

        def panel(station):
            def answer(frame):
                time.sleep(thinks.get(station, 0.004))
                return reading(frame[1:-2], lambda at: station)
            return answer
        panels = {station: panel(station) for station in (*thinks, 31)}
        with line_of(panels, "{id: 31, name: press}", baud=38400, retries=0) as (program, _), \
                program.client() as client:
            for turn in range(20):
                self.assertEqual(client.ask(31, read_registers(turn, 1))[0], 3)
            found = [station for station in range(20, 28)
                     if client.ask(station, read_registers(0)) == bytes([3, 2, 0, station])]
            self.assertEqual(found, list(thinks))


class RightAnswer(unittest.TestCase):
    def test_a_right_answer_in_time_is_taken_though_an_earlier_read_is_unanswered(self):
        """T2, T11: a read is unanswered, a broadcast writes its place, and the client of the
        broadcast reads the place. A late reply to the first read must not replace the answer."""
        memory, asked = {}, {"unanswered": [], "own": 0, "mute": False}

        def write(frame):
            memory.update([struct.unpack(">HH", frame[2:6])])

        def answer(frame):
            reply = reading(frame[1:-2], lambda at: memory.get(at, 1000 + at))
            if asked["mute"]:
                asked["unanswered"].append(harness.rtu(1, reply))
                return None
            if frame[1:-2] == place:
                asked["own"] += 1
                if asked["own"] == 2:  # somebody asks again: the late reply comes first
                    bus.inject(asked["unanswered"][0])
            time.sleep(0.015)
            return reply
        place = read_registers(100, 1)
        with line_of({0: write, 1: answer}, "{id: 1, name: press}", baud=115200,
                     quarantine="station", queue="{deadline: 10s}") as (program, bus), \
                program.client() as reader, program.client() as writer:
            reader.ask(1, read_registers(1, 2))
            asked["mute"] = True
            reader.send(1, place)
            bus.wait_for(2, station=1)
            broadcast = write_register(100, 4711)
            self.assertEqual(writer.ask(0, broadcast), broadcast)
            self.assertEqual(reader.receive()[2], fault(3, 0x0B))
            asked["mute"] = False
            self.assertEqual(writer.ask(1, place), b"\x03\x02" + struct.pack(">H", 4711))
            self.assertEqual(asked["own"], 1)


if __name__ == "__main__":
    unittest.main()
