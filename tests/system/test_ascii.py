"""Panels that speak Modbus ASCII: a foreign slave on a paced wire, simulated ones with faults, what a
scan finds, and what `check` says."""
import asyncio
import logging
import pathlib
import struct
import tempfile
import threading
import unittest

from pymodbus.datastore import (ModbusSequentialDataBlock, ModbusServerContext,
                                ModbusSlaveContext)
from pymodbus.server.async_io import ModbusSerialServer
from pymodbus.transaction import ModbusAsciiFramer

import config
import harness
from harness import read_registers, write_register
from test_scan import scan, simulated

logging.disable()  # pymodbus tells of what is asked on purpose
BUILT = pathlib.Path(harness.PANELGATE).resolve().parent
UNIT = 17
ASCII = "{mode: ascii, baud: 38400}"


def known(address):
    return (address * 31 + 7) & 0xFFFF


class ForeignSlave:
    """pymodbus as a slave on a device."""

    def __init__(self, device, framer=ModbusAsciiFramer):
        self._device = device
        self._framer = framer
        self._loop = asyncio.new_event_loop()
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self):
        self._thread.start()
        assert self._ready.wait(harness.PATIENCE)
        return self

    def __exit__(self, *_):
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(harness.PATIENCE)

    def _run(self):
        asyncio.set_event_loop(self._loop)
        # Addresses of pymodbus begin at 1, those on the wire at 0.
        block = ModbusSequentialDataBlock(0, [known(a - 1) for a in range(500)])
        context = ModbusServerContext({UNIT: ModbusSlaveContext(hr=block, ir=block)}, single=False)
        server = ModbusSerialServer(context, framer=self._framer, port=self._device,
                                    baudrate=38400, parity="N", ignore_missing_slaves=True)
        self._loop.run_until_complete(server.start())
        self._ready.set()
        self._loop.run_forever()
        tasks = asyncio.all_tasks(self._loop)
        for task in tasks:
            task.cancel()
        self._loop.run_until_complete(asyncio.gather(*tasks, return_exceptions=True))


@unittest.skipUnless((BUILT / "serial_pair").exists(), "the paced pair is not built")
class Foreign(unittest.TestCase):
    def test_pymodbus_is_read_and_written(self):
        with tempfile.TemporaryDirectory() as folder:
            far, near = f"{folder}/far", f"{folder}/near"
            line = config.line(device=far, stations=f"{{id: {UNIT}, name: press}}", serial=(
                "{mode: ascii, baud: 38400, data_bits: 8, parity: none}"))
            with harness.Helper([BUILT / "serial_pair", "38400", far, near]) as pair:
                pair.out.wait_for("ready")
                with ForeignSlave(near), harness.configured(config.gateway(line)) as program, \
                        program.client() as client:
                    self.read_and_write(client)
                    self.assertEqual(client.ask(UNIT, read_registers(490, 100)), b"\x83\x02")
                    self.assertEqual(client.ask(9, read_registers(0))[0], 0x83)

    def read_and_write(self, client):
        for address in range(0, 400, 40):
            wanted = struct.pack(">BB40H", 3, 80, *(known(address + i) for i in range(40)))
            self.assertEqual(client.ask(UNIT, read_registers(address, 40)), wanted)
        for address in range(3):
            request = write_register(address, 0xA5C3 + address)
            self.assertEqual(client.ask(UNIT, request), request)
            self.assertEqual(client.ask(UNIT, read_registers(address)),
                             struct.pack(">BBH", 3, 2, 0xA5C3 + address))
        many = struct.pack(">BHHB2H", 16, 5, 2, 4, 0x0A0D, 0x3A00)
        self.assertEqual(client.ask(UNIT, many), many[:5])
        self.assertEqual(client.ask(UNIT, read_registers(5, 2)), b"\x03\x04\x0a\x0d\x3a\x00")


class Reader(threading.Thread):
    """Writes numbers to a register of its own and reads them again; what it may hold is known."""

    def __init__(self, program, unit, address, rounds):
        super().__init__()
        self._program, self._unit, self._address, self._rounds = program, unit, address, rounds
        self.good, self.failed, self.wrong = 0, 0, []

    def run(self):
        with self._program.client() as client:
            possible = set(range(65536))
            for turn in range(self._rounds):
                value = (self._address * 97 + turn * 257) & 0xFFFF
                reply = client.ask(self._unit, write_register(self._address, value))
                done = reply == write_register(self._address, value)
                possible = {value} if done else possible | {value}
                self.count(done, reply)
                reply = client.ask(self._unit, read_registers(self._address))
                read = reply[0] == 3
                self.count(read, reply)
                if read and struct.unpack(">H", reply[2:])[0] not in possible:
                    self.wrong.append((turn, reply.hex(), len(possible)))

    def count(self, good, reply):
        self.good += good
        self.failed += not good
        if not good and reply[0] & 0x80 == 0:
            self.wrong.append(reply.hex())


class Simulated(unittest.TestCase):
    def test_the_frames_of_the_manual_come_out_and_the_trace_has_them_as_rtu_says_them(self):
        for serial in ("{mode: ascii}", "{mode: ascii, data_bits: 8, parity: none}"):
            line = config.line(serial=serial)
            with self.subTest(serial=serial), harness.configured(
                    config.gateway(line)) as program, program.client() as client:
                asked = read_registers(0, 2)
                self.assertEqual(client.ask(31, asked), b"\x03\x04\x00\x0a\x00\x14")
                frames = [frame for _, frame in program.trace("floor1")]
            self.assertIn(harness.rtu(31, asked), frames)
            self.assertIn(harness.rtu(31, b"\x03\x04\x00\x0a\x00\x14"), frames)

    def test_P1_nothing_is_wrong_where_replies_are_late_damaged_cut_and_said_twice(self):
        faults = ("simulate: {late: 0.02, late_by: 450ms, damage: 0.05, truncate: 0.02, drop: 0.02,"
                  " duplicate: 0.02, foreign_id: 0.02}")
        stations = (f"{{id: 31, name: press, profile: autonics-gplp-s, {faults}}},"
                    f" {{id: 5, name: mixer, profile: autonics-gp-2005, {faults}}}")
        line = config.line(stations=stations, serial="{mode: ascii, baud: 115200}",
                           timing="{response_timeout: 300ms, reply_hole: 200ms}",
                           # Offline, each question of these clients that never pause fails at once.
                           offline="{after: 100}")
        with harness.configured(config.gateway(line)) as program:
            readers = [Reader(program, unit, 110 + i, 40) for unit in (31, 5) for i in range(3)]
            for reader in readers:
                reader.start()
            for reader in readers:
                reader.join(120)
        self.assertEqual([reader.wrong for reader in readers], [[]] * len(readers))
        good, failed = sum(r.good for r in readers), sum(r.failed for r in readers)
        print(f"\n  {good} good answers, {failed} failed")
        # How many fail is the machine's affair as well: panels and gateway share it with others.
        self.assertGreater(good, failed)

    def test_an_echo_is_found_out(self):
        line = config.line(serial=ASCII, simulate="{echo: true}")
        with harness.configured(config.gateway(line)) as program, program.client() as client:
            for value in range(5):
                request = write_register(100, value)
                self.assertEqual(client.ask(31, request), request)
                self.assertEqual(client.ask(31, read_registers(100)),
                                 struct.pack(">BBH", 3, 2, value))


class OverTcp(unittest.TestCase):
    def test_panels_behind_a_device_server_are_read_and_found(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "lines.yaml"
            file.write_text(config.gateway(config.line("a", serial=ASCII)))
            with harness.Program("simulate", "-c", str(file), "--line",
                                 "a=tcp://127.0.0.1:0") as panels:
                port = panels.log.wait_for(r"rtu_over_tcp=127\.0\.0\.1:(\d+)").group(1)
                device = f"tcp://127.0.0.1:{port}"
                line = config.line(device=device, serial=ASCII)
                with harness.configured(config.gateway(line)) as program, \
                        program.client() as client:
                    self.assertEqual(client.ask(31, read_registers(0, 2)),
                                     b"\x03\x04\x00\x0a\x00\x14")
                    request = write_register(100, 4711)
                    self.assertEqual(client.ask(31, request), request)
                code, out, err = scan(device, "--stations", "31", "--yaml")
        self.assertEqual(code, 0, out + err)
        self.assertIn("serial: {mode: ascii, ", out)
        self.assertIn("id: 31, name: station-31, profile: autonics-gplp-s", out)


class Scanned(unittest.TestCase):
    def test_a_scan_finds_panels_that_speak_ascii_and_its_file_says_so(self):
        stations = "{id: 5, profile: autonics-gp-2005}, {id: 31, profile: autonics-gplp-s}"
        with simulated(config.line("a", stations=stations, serial=ASCII)) as links:
            code, out, err = scan(links["a"], "--stations", "5,31", "--baud", "38400", "--yaml")
        self.assertEqual(code, 0, out + err)
        self.assertIn("serial: {mode: ascii, baud: 38400, data_bits: 7, parity: even, "
                      "stop_bits: 1}", out)
        self.assertIn("id: 31, name: station-31, profile: autonics-gplp-s", out)
        self.assertIn("id: 5, name: station-5, profile: autonics-gp-2005", out)
        with simulated(config.line("b", serial=ASCII)) as links:
            code, out, _ = scan(links["b"], "--stations", "31", "--baud", "38400")
        self.assertEqual(code, 0, out)
        self.assertIn("38400 7E1 ASCII, 1 station", out)


if __name__ == "__main__":
    unittest.main()
