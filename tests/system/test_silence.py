"""Panels that do not answer, broadcasts, and a device that comes and goes: what is on the wire is
recorded by a scripted line."""
import contextlib
import pathlib
import signal
import struct
import tempfile
import threading
import time
import unittest

import config
import harness
from harness import read_registers, write_register
from rtu_bus import Raw, RtuBus, echo_address, scripted

TIMEOUT, RETRIES, TURNAROUND = 0.2, 2, 0.3  # seconds, as configured below
BUSY, NO_PATH, NO_REPLY = 6, 10, 11


def fault(function, code):
    return bytes([function | 0x80, code])


def holding(*values):
    return struct.pack(f">BB{len(values)}H", 3, 2 * len(values), *values)


def configuration(link, response_timeout="200ms", **more):
    return config.gateway(config.line(
        device=link, retries=2, queue="{deadline: 5s}", **more,
        timing=f"{{response_timeout: {response_timeout}, broadcast_turnaround: 300ms}}",
        stations="{id: 1, name: good, profile: generic}, {id: 2, name: bad, profile: generic}"))


@contextlib.contextmanager
def gateway_and_bus(panels, **more):
    with tempfile.TemporaryDirectory() as folder:
        link = pathlib.Path(folder) / "tty"
        with RtuBus(link, panels) as bus, \
                harness.configured(configuration(link, **more)) as program:
            program.log.wait_for("line up")
            # A line that has carried a read before anything else happens.
            with program.client() as client:
                assert client.ask(1, read_registers(7)) == holding(7)
            bus.wait_for(1)
            yield program, bus


class SilentStation(unittest.TestCase):
    def test_P2_P3_a_read_is_tried_again_then_answered_0b(self):
        with gateway_and_bus({1: echo_address}) as (program, bus), program.client() as client:
            start = time.monotonic()
            self.assertEqual(client.ask(2, read_registers(0)), fault(3, NO_REPLY))
            self.assertGreaterEqual(time.monotonic() - start, TIMEOUT)
            request = harness.rtu(2, read_registers(0))
            self.assertEqual([f.bytes for f in bus.frames(2)], [request] * (RETRIES + 1))

    def test_P2_a_write_is_on_the_wire_once(self):
        with gateway_and_bus({1: echo_address}) as (program, bus), program.client() as client:
            self.assertEqual(client.ask(2, write_register(4, 5)), fault(6, NO_REPLY))
            self.assertEqual(client.ask(1, read_registers(9)), holding(9))  # all is quiet again
            self.assertEqual([f.bytes for f in bus.frames(2)], [harness.rtu(2, write_register(4, 5))])

    OTHERS = 3

    def ask_beside_a_silent_one(self, program, bus):
        """One client asks the silent station, others a good one; the frames from then on."""
        with contextlib.ExitStack() as stack:
            patient, *others = [stack.enter_context(program.client())
                                for _ in range(1 + self.OTHERS)]
            patient.send(2, read_registers(0))
            bus.wait_for(1, station=2)
            for address, other in enumerate(others, 20):
                other.send(1, read_registers(2 * address))
            self.assertEqual(patient.receive()[2], fault(3, NO_REPLY))
            for address, other in enumerate(others, 20):
                self.assertEqual(other.receive()[2], holding(2 * address))
            return bus.frames()[1:]

    def test_other_clients_wait_for_one_timeout_at_most(self):
        with gateway_and_bus({1: echo_address}) as (program, bus):
            frames = self.ask_beside_a_silent_one(program, bus)
            order = [f.bytes[0] for f in frames]
            self.assertEqual(order[:2], [2, 1])  # a retry lets one other go first
            self.assertEqual(sorted(order), [1] * self.OTHERS + [2] * (RETRIES + 1))
            self.assertGreaterEqual(frames[1].at - frames[0].at, TIMEOUT * 5 / 6)

    def test_P1_where_the_line_rests_all_wait_until_no_late_reply_can_come(self):
        with gateway_and_bus({1: echo_address}, quarantine="line") as (program, bus):
            frames = self.ask_beside_a_silent_one(program, bus)
            self.assertEqual([f.bytes[0] for f in frames], [2] * (RETRIES + 1) + [1] * self.OTHERS)
            last_attempt, first_other = frames[RETRIES:RETRIES + 2]
            self.assertGreaterEqual(first_other.at - last_attempt.at, TIMEOUT * 5 / 6)

    def test_P1_a_late_reply_never_answers_a_later_request(self):
        late = [None] * (RETRIES + 1)
        with gateway_and_bus({1: echo_address, 2: scripted(*late, echo_address)}) as (program, bus), \
                program.client() as client:
            self.assertEqual(client.ask(2, read_registers(3)), fault(3, NO_REPLY))
            bus.inject(harness.rtu(2, holding(3)))
            for address in range(9, 12):
                self.assertEqual(client.ask(2, read_registers(address)), holding(address))

    def test_a_reply_in_time_of_the_second_attempt_is_the_answer(self):
        with gateway_and_bus({1: echo_address, 2: scripted(None, echo_address)}) as (program, bus), \
                program.client() as client:
            self.assertEqual(client.ask(2, read_registers(3)), holding(3))
            self.assertEqual(len(bus.frames(2)), 2)

    def test_P4_a_station_that_stays_silent_is_answered_at_once_and_comes_back(self):
        alive = threading.Event()

        def panel(frame):
            return echo_address(frame) if alive.is_set() else None
        with gateway_and_bus({1: echo_address, 2: panel}) as (program, bus), \
                program.client() as client:
            for address in range(4):  # each asked RETRIES + 1 times, until it is offline
                self.assertEqual(client.ask(2, read_registers(address)), fault(3, NO_REPLY))
            self.assertLess(len(bus.frames(2)), 4 * (RETRIES + 1))
            self.assertEqual(client.ask(1, read_registers(7)), holding(7))
            alive.set()
            program.log.wait_for("station online")
            self.assertEqual(client.ask(2, read_registers(5)), holding(5))


class Noise(unittest.TestCase):
    def test_P1_a_damaged_reply_is_asked_again_and_never_forwarded(self):
        damaged = Raw(harness.rtu(2, holding(4711))[:-1] + b"\0")
        with gateway_and_bus({1: echo_address, 2: scripted(damaged, echo_address)}) as (program, bus), \
                program.client() as client:
            self.assertEqual(client.ask(2, read_registers(3)), holding(3))
            self.assertEqual(len(bus.frames(2)), 2)

    def test_P1_the_reply_of_another_station_or_function_is_not_taken(self):
        for foreign in (harness.rtu(1, holding(4711)), harness.rtu(2, b"\x04\x02\x12\x67"),
                        harness.rtu(2, holding(4711, 4711))):
            with self.subTest(foreign=foreign.hex(" ")):
                panels = {1: echo_address, 2: scripted(Raw(foreign))}
                with gateway_and_bus(panels) as (program, bus), program.client() as client:
                    self.assertEqual(client.ask(2, read_registers(3)), fault(3, NO_REPLY))

    def test_garbage_around_a_reply_and_between_requests_is_stepped_over(self):
        """T3, FRM-07: bytes behind a good frame are dropped, and the frame counts."""
        def surrounded(frame):
            return Raw(b"\xff\x00\x55" + harness.rtu(frame[0], echo_address(frame)) + b"\xaa\xaa")
        with gateway_and_bus({1: echo_address, 2: surrounded}) as (program, bus), \
                program.client() as client:
            for address in range(20):
                self.assertEqual(client.ask(2, read_registers(address)), holding(address))
                bus.inject(bytes(range(address, address + 40)))
                self.assertEqual(client.ask(1, read_registers(address)), holding(address))


class Broadcast(unittest.TestCase):
    def test_one_frame_a_reply_at_once_and_a_pause_before_the_next(self):
        with gateway_and_bus({1: echo_address}) as (program, bus), program.client() as client:
            start = time.monotonic()
            self.assertEqual(client.ask(0, write_register(4, 5)), write_register(4, 5))
            answered = time.monotonic()
            self.assertEqual(client.ask(1, read_registers(9)), holding(9))
            sent, following = bus.frames()[1:]
            self.assertEqual(sent.bytes, harness.rtu(0, write_register(4, 5)))
            # The record's clock may be read late, never early: a sixth of the pause is allowed.
            self.assertGreaterEqual(following.at - sent.at, TURNAROUND * 5 / 6)
            self.assertLess(answered - start, following.at - start)
            self.assertEqual(len(bus.frames(0)), 1)

    def test_a_write_of_several_is_answered_with_address_and_quantity(self):
        with gateway_and_bus({1: echo_address}) as (program, bus), program.client() as client:
            pdu = struct.pack(">BHHB2H", 16, 100, 2, 4, 7, 8)
            self.assertEqual(client.ask(0, pdu), pdu[:5])
            self.assertEqual(bus.wait_for(1, station=0).bytes, harness.rtu(0, pdu))

    def test_a_read_is_refused_and_never_sent(self):
        with gateway_and_bus({1: echo_address}) as (program, bus), program.client() as client:
            self.assertEqual(client.ask(0, read_registers(0)), fault(3, NO_PATH))
            self.assertEqual(bus.frames(0), [])


class Device(unittest.TestCase):
    def test_P7_one_that_is_missing_at_start_may_come_later(self):
        with tempfile.TemporaryDirectory() as folder:
            link = pathlib.Path(folder) / "tty"
            with harness.configured(configuration(link)) as program, program.client() as client:
                self.assertEqual(program.get("/readyz")[0], 200)
                self.assertEqual(client.ask(1, read_registers(5)), fault(3, NO_PATH))
                with RtuBus(link, {1: echo_address}):
                    program.log.wait_for("line up")
                    self.assertEqual(client.ask(1, read_registers(5)), holding(5))

    def test_P7_one_that_is_unplugged_and_replugged_works_again(self):
        with tempfile.TemporaryDirectory() as folder:
            link = pathlib.Path(folder) / "tty"
            with contextlib.ExitStack() as stack:
                first = contextlib.ExitStack()
                first.enter_context(RtuBus(link, {1: echo_address}))
                program = stack.enter_context(harness.configured(configuration(link)))
                client = stack.enter_context(program.client())
                program.log.wait_for("line up")
                self.assertEqual(client.ask(1, read_registers(5)), holding(5))
                first.close()
                program.log.wait_for("line down")
                self.assertEqual(client.ask(1, read_registers(5)), fault(3, NO_PATH))
                self.assertEqual(program.get("/readyz")[0], 200)
                stack.enter_context(RtuBus(link, {1: echo_address}))
                program.log.wait_for("line up", 2)
                self.assertEqual(client.ask(1, read_registers(6)), holding(6))


class Ending(unittest.TestCase):
    def test_P3_sigterm_answers_what_is_on_the_wire(self):
        may_answer = threading.Event()
        self.addCleanup(may_answer.set)

        def slow(frame):
            return echo_address(frame) if may_answer.wait(harness.PATIENCE) else None
        with tempfile.TemporaryDirectory() as folder:
            link = pathlib.Path(folder) / "tty"
            with RtuBus(link, {1: slow}) as bus, \
                    harness.configured(configuration(link, "4s")) as program:
                program.log.wait_for("line up")
                with program.client() as client:
                    client.send(1, read_registers(5))
                    bus.wait_for(1)
                    program.process.send_signal(signal.SIGTERM)
                    program.log.wait_for("stopping")
                    may_answer.set()
                    self.assertEqual(client.receive()[2], holding(5))
                    self.assertTrue(client.is_closed_by_peer())
                self.assertEqual(program.wait(), 0)


if __name__ == "__main__":
    unittest.main()
