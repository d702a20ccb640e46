"""P8: adapters that hear themselves, in every way: nothing is confirmed by its own echo."""
import contextlib
import itertools
import pathlib
import struct
import tempfile
import unittest

import config
import harness
from harness import read_registers, write_register
from rtu_bus import RtuBus

ECHOES = {
    "none": lambda frame: b"",
    "full": lambda frame: frame,
    "partial": lambda frame: frame[3:],
    "damaged": lambda frame: frame[:-1] + bytes([frame[-1] ^ 0x10]),
}
WRITE_COIL = b"\x05\x00\x07\xff\x00"


class Panel:
    """Every register holds its own address, until something else is written."""

    def __init__(self):
        self._coils, self._registers = {}, {}

    def __call__(self, frame):
        function, address, value = struct.unpack(">BHH", frame[1:6])
        if function == 1:
            return bytes([1, 1, self._coils.get(address, 0)])
        if function == 3:
            return holding(*(self._registers.get(at, at) for at in range(address, address + value)))
        if function == 5:
            self._coils[address] = 1 if value else 0
        if function == 6:
            self._registers[address] = value
        return frame[1:6]


def holding(*values):
    return struct.pack(f">BB{len(values)}H", 3, 2 * len(values), *values)


def configuration(link, mode):
    return config.gateway(config.line(
        device=link, stations="{id: 1, name: good}, {id: 2, name: absent}", baud=115200,
        timing="{response_timeout: 120ms}", retries=1, echo=mode), http=config.ADMIN)


@contextlib.contextmanager
def line(mode, echo, glued):
    with tempfile.TemporaryDirectory() as folder:
        link = pathlib.Path(folder) / "tty"
        with RtuBus(link, {1: Panel()}, ECHOES[echo], glued) as bus, \
                harness.configured(configuration(link, mode)) as program:
            program.log.wait_for("line up")
            with program.client() as client:
                yield client, bus, program


class Echo(unittest.TestCase):
    def check(self, client, bus, knows):
        """`knows`: the line's echo is what the gateway takes it for, so everything must work."""
        reply = client.ask(1, read_registers(7))
        self.assertIn(reply, [holding(7), b"\x83\x0b"])
        if knows:
            self.assertEqual(reply, holding(7))
        for number, write in enumerate((WRITE_COIL, write_register(4, 5), write_register(5, 6))):
            absent = client.ask(2, write)
            self.assertEqual(absent, bytes([write[0] | 0x80, 0x0B]), "confirmed by its own echo")
            present = client.ask(1, write)
            if knows:
                self.assertEqual(present, write)
            if present == write:
                sent = [f.bytes for f in bus.frames(1)]
                self.assertIn(harness.rtu(1, write), sent)
            self.assertEqual([f.bytes for f in bus.frames(2)].count(harness.rtu(2, write)) > 1, False,
                             f"write {number} was repeated")

    def test_P8_echo_matrix(self):
        for mode, echo, glued in itertools.product(("auto", "on"), ECHOES, (False, True)):
            with self.subTest(mode=mode, echo=echo, glued=glued), line(mode, echo, glued) as (c, bus, _):
                self.check(c, bus, knows=(mode == "auto" and echo in ("none", "full")) or
                           (mode == "on" and echo == "full"))

    def test_P8_an_echo_that_the_configuration_denies_is_said_in_the_log(self):
        with line("off", "full", False) as (client, bus, program):
            self.check(client, bus, knows=True)
            program.log.wait_for("line hears itself")
            self.assertEqual(program.get("/api/v1/lines/floor1")[1]["echo"], "present")

    def test_P8_the_first_write_to_a_silent_station_is_not_transmitted(self):
        with line("auto", "full", False) as (client, bus, program):
            path, body = "/api/v1/stations/absent/holding-registers/1", {"values": [1]}
            status, first = program.rest("PUT", path, body)
            self.assertEqual((status, first["transmitted"]), (504, False), first)
            self.assertEqual({f.bytes[1] for f in bus.frames(2)}, {3})
            # Its echo has told: the next one is transmitted, and still not confirmed.
            self.assertEqual(client.ask(2, WRITE_COIL), b"\x85\x0b")
            self.assertEqual(bus.frames(2)[-1].bytes, harness.rtu(2, WRITE_COIL))

    def test_P8_collisions_are_counted(self):
        with line("on", "damaged", False) as (client, _, program):
            # The panel has understood all the same.
            self.assertEqual(client.ask(1, read_registers(7)), b"\x03\x02\x00\x07")
            program.log.wait_for("collision")
            self.assertRegex(program.get("/metrics")[1],
                             r'panelgate_echo_mismatch_total\{line="floor1",station="good"\} 1')


if __name__ == "__main__":
    unittest.main()
