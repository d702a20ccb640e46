"""An existing master on a serial port of the gateway: it goes on polling as it did, unchanged, while
TCP clients share the line."""
import contextlib
import json
import os
import pathlib
import select
import subprocess
import tempfile
import threading
import tty
import unittest

from pymodbus.client import ModbusSerialClient

import config
import harness
from rtu_bus import RtuBus, echo_address

BUILT = pathlib.Path(harness.PANELGATE).resolve().parent
UNIT = 31
KNOWN = 2010  # registers that the libmodbus master reads
SHARING = 8


def known(address):
    return (UNIT * 257 + address * 31 + 7) & 0xFFFF


def written(address, values):
    data = b"".join(value.to_bytes(2, "big") for value in values)
    return bytes([16]) + address.to_bytes(2, "big") + len(values).to_bytes(2, "big") + \
        bytes([len(data)]) + data


class Master(harness.Helper):
    """A test program that answers a line on stdin by one."""

    def run(self, seconds):
        self.process.stdin.write(f"{seconds}\n")
        self.process.stdin.flush()
        return json.loads(self.out.wait_for("^{.*").group())


class Port:
    """A paced wire of pseudo-terminals from `far`, which the gateway opens, to `near`."""

    def __init__(self, folder, baud):
        self.far, self.near = f"{folder}/far", f"{folder}/near"
        self._pair = harness.Helper([BUILT / "serial_pair", baud, self.far, self.near])

    def __enter__(self):
        self._pair.out.wait_for("ready")
        return self

    def __exit__(self, *_):
        self._pair.__exit__()


class RawMaster:
    """What it says is what the test says."""

    def __init__(self, device):
        self._device = os.open(device, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self._device)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.close(self._device)

    def say(self, data):
        os.write(self._device, data)

    def hear(self, count):
        data = b""
        while len(data) < count and select.select([self._device], [], [], harness.PATIENCE)[0]:
            data += os.read(self._device, count - len(data))
        return data

    def ask(self, unit, pdu):
        self.say(harness.rtu(unit, pdu))


def master(port, baud, **keys):
    """An entry of serial_masters."""
    values = {"name": "plc", "device": port.far,
              "serial": f"{{baud: {baud}, parity: none}}", **keys}
    return "[{" + ", ".join(f"{key}: {value}" for key, value in values.items()) + "}]"


def sharing(program, stop, faults):
    """A TCP client that reads what it knows until told to stop."""
    with program.client() as client:
        address = 0
        while not stop.is_set():
            address = (address + 97) % (KNOWN - 10)
            wanted = b"".join(known(address + i).to_bytes(2, "big") for i in range(10))
            reply = client.ask(UNIT, harness.read_registers(address, 10))
            if reply != bytes([3, 20]) + wanted:
                faults.append((address, reply))


@contextlib.contextmanager
def shared_by_eight(program):
    stop, faults = threading.Event(), []
    threads = [threading.Thread(target=sharing, args=(program, stop, faults))
               for _ in range(SHARING)]
    for thread in threads:
        thread.start()
    try:
        yield
    finally:
        stop.set()
        for thread in threads:
            thread.join(harness.PATIENCE)
    assert not faults, faults[:3]


def metric(program, name):
    text = program.get("/metrics")[1]
    return next(float(line.rsplit(" ", 1)[1]) for line in text.splitlines()
                if line.startswith(f'panelgate_serial_master_{name}{{master="plc"}}'))


@contextlib.contextmanager
def beside_clients(baud, framing="rtu"):
    """A master's port in front of a paced line with one panel of known values."""
    line = config.line(stations=f"{{id: {UNIT}, name: press}}", baud=115200)
    with tempfile.TemporaryDirectory() as folder, Port(folder, baud) as port, \
            harness.configured(config.gateway(
                line, serial_masters=master(port, baud, framing=framing))) as program:
        program.log.wait_for("serial master up")
        with program.client() as client:
            for at in range(0, KNOWN, 100):
                values = [known(at + i) for i in range(min(100, KNOWN - at))]
                assert client.ask(UNIT, written(at, values))[0] == 16
        yield program, port


@unittest.skipUnless((BUILT / "serial_pair").exists(), "the paced pair is not built")
class UnchangedMasters(unittest.TestCase):
    @unittest.skipUnless((BUILT / "libmodbus_master").exists(), "there is no libmodbus")
    def test_libmodbus_polls_and_writes_within_its_timeout(self):
        for baud in (9600, 19200, 115200):
            with self.subTest(baud=baud), beside_clients(baud) as (program, port), \
                    Master([BUILT / "libmodbus_master", "rtu", port.near, baud, UNIT]) as plc:
                with shared_by_eight(program):
                    seen = plc.run(3)
                print(f"\n  {baud}: {seen['good'] / seen['seconds']:.0f} good answers a second")
                self.assertEqual(seen["failed"], {})
                self.assertGreater(seen["good"], 30)
                self.assertEqual(metric(program, "replies_total"), seen["good"])
                self.assertEqual(metric(program, "superseded_total"), 0)

    def test_pymodbus_reads_and_writes(self):
        with beside_clients(19200) as (program, port), ModbusSerialClient(
                port.near, baudrate=19200, parity="N", timeout=5) as plc:
            with shared_by_eight(program):
                for address in range(0, 1000, 50):
                    reply = plc.read_holding_registers(address, 5, slave=UNIT)
                    self.assertEqual(reply.registers, [known(address + i) for i in range(5)])
                    reply = plc.write_register(3000 + address, address, slave=UNIT)
                    self.assertFalse(reply.isError(), reply)
                    reply = plc.read_holding_registers(3000 + address, 1, slave=UNIT)
                    self.assertEqual(reply.registers, [address])

    def test_mbpoll_reads_and_writes(self):
        with beside_clients(9600) as (program, port):
            common = ["mbpoll", "-m", "rtu", "-a", str(UNIT), "-b", "9600", "-P", "none", "-0",
                      "-o", "5"]

            def poll(*arguments):
                done = subprocess.run([*common, *arguments], capture_output=True, text=True,
                                      timeout=harness.PATIENCE, check=False)
                self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
                return done.stdout

            with shared_by_eight(program):
                self.assertRegex(poll("-r", "70", "-c", "2", "-1", port.near),
                                 rf"\[70\]:\s+{known(70)}\b")
                poll("-r", "4000", port.near, "4711")
                self.assertRegex(poll("-r", "4000", "-c", "1", "-1", port.near), r"\b4711\b")


@unittest.skipUnless((BUILT / "serial_pair").exists(), "the paced pair is not built")
class SlaveSide(unittest.TestCase):
    """On a line where every frame that goes out is seen."""

    @contextlib.contextmanager
    def line(self, panels, baud=115200, **keys):
        with tempfile.TemporaryDirectory() as folder, Port(folder, baud) as port, \
                RtuBus(f"{folder}/bus", panels) as bus:
            line = config.line(device=f"{folder}/bus", stations="{id: 1, name: one}", retries=0,
                               baud=115200, timing="{response_timeout: 60ms}")
            text = config.gateway(line, serial_masters=master(port, baud, **keys))
            with harness.configured(text) as program, RawMaster(port.near) as plc:
                program.log.wait_for("line up")
                program.log.wait_for("serial master up")
                yield program, bus, plc

    def test_units_that_are_not_served_are_silent(self):
        with self.line({1: echo_address}) as (program, bus, plc):
            plc.ask(9, harness.read_registers(5))
            plc.ask(9, bytes([3, 2, 0, 7]))  # who has that unit answers
            plc.ask(1, harness.read_registers(6))
            self.assertEqual(plc.hear(7), harness.rtu(1, bytes([3, 2, 0, 6])))
            self.assertEqual([frame.bytes[0] for frame in bus.frames()], [1])
            self.assertEqual(metric(program, "foreign_frames_total"), 2)

    def test_a_broadcast_goes_out_once(self):
        with self.line({1: echo_address}) as (_, bus, plc):
            plc.ask(0, harness.write_register(7, 8))
            bus.wait_for(1, station=0)
            plc.ask(1, harness.read_registers(6))
            self.assertEqual(plc.hear(7), harness.rtu(1, bytes([3, 2, 0, 6])))
            self.assertEqual([frame.bytes for frame in bus.frames(0)],
                             [harness.rtu(0, harness.write_register(7, 8))])

    def test_a_panel_that_is_silent_is_silent(self):
        with self.line({1: lambda frame: None if frame[3] == 9 else echo_address(frame)}) as \
                (program, bus, plc):
            plc.ask(1, harness.read_registers(9))
            bus.wait_for(1)
            while metric(program, "silent_total") < 1:
                pass
            plc.ask(1, harness.read_registers(6))
            self.assertEqual(plc.hear(7), harness.rtu(1, bytes([3, 2, 0, 6])))

    def test_or_an_exception_tells(self):
        with self.line({1: lambda _: None}, on_failure="exception") as (_, _, plc):
            plc.ask(1, harness.read_registers(9))
            self.assertEqual(plc.hear(5), harness.rtu(1, bytes([0x83, 0x0B])))

    def test_ascii_is_understood(self):
        def ascii_frame(station, pdu):
            data = bytes([station]) + pdu
            return b":" + (data + bytes([-sum(data) & 0xFF])).hex().upper().encode() + b"\r\n"
        with self.line({1: echo_address}, framing="ascii") as (_, _, plc):
            plc.say(ascii_frame(1, harness.read_registers(6)))
            wanted = ascii_frame(1, bytes([3, 2, 0, 6]))
            self.assertEqual(plc.hear(len(wanted)), wanted)

    def test_a_port_that_comes_back_is_served_again(self):
        with tempfile.TemporaryDirectory() as folder:
            port = Port(folder, 115200)
            text = config.gateway(config.line(stations=f"{{id: {UNIT}, name: press}}"),
                                  serial_masters=master(port, 115200))
            with port as first, harness.configured(text) as program:
                program.log.wait_for("serial master up")
                self.exchange(first)
                first.__exit__()
                program.log.wait_for("serial master down")
                with Port(folder, 115200) as second:
                    program.log.wait_for("serial master up", 2)
                    self.exchange(second)
                    self.assertEqual(metric(program, "up"), 1)
                    self.assertEqual(metric(program, "reopens_total"), 1)

    def exchange(self, port):
        with RawMaster(port.near) as plc:
            plc.ask(UNIT, harness.read_registers(6))
            self.assertEqual(len(plc.hear(7)), 7)


if __name__ == "__main__":
    unittest.main()
