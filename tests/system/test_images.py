"""Images: points of many stations as one unit, read without their lines."""
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import unittest
import urllib.request

import config
import harness
from harness import read_registers, write_register
from test_points import until
from test_reload import Running

PRESS = ("{id: 1, name: press, points: [{name: level, at: '400010', every: 50ms, writable: true, max: 5000}, "
         "{name: flow, at: '400020', type: f32, every: 50ms, writable: true}, "
         "{name: on, at: '400030', bit: 3, every: 50ms}, {name: locked, at: '400040', every: 50ms}]}")
OVEN = ("{id: 2, name: oven, points: [{name: level, at: '400011', every: 50ms}, "
        "{name: hot, at: '000005', every: 50ms, writable: true}]}")
POINTS = "[press/level, oven/level, {skip: 2}, press/flow, press/on, oven/hot, press/locked]"

FOREIGN = """
import asyncio
from pymodbus.datastore import ModbusSequentialDataBlock as Block, ModbusServerContext, ModbusSlaveContext
from pymodbus.server import StartAsyncTcpServer
def unit(first):
    return ModbusSlaveContext(hr=Block(0, list(range(first, first + 300))), co=Block(0, [0] * 100), zero_mode=True)
asyncio.run(StartAsyncTcpServer(ModbusServerContext({1: unit(1000), 2: unit(2000)}, single=False),
                                address=("127.0.0.1", PORT)))
"""
# notation 400010 of the generic panel is the register with this address
LEVEL, OVEN_LEVEL, FLOW, LOCKED = 1009, 2010, (1019, 1020), 1039


def image(name="plant", unit=100, points=POINTS, more=""):
    return f"{{name: {name}, unit: {unit}, points: {points}{more}}}"


def read(address, count, function=3):
    return struct.pack(">BHH", function, address, count)


def registers(*values):
    return bytes([3, 2 * len(values)]) + struct.pack(f">{len(values)}H", *values)


def write(address, *values):
    return struct.pack(f">BHHB{len(values)}H", 16, address, len(values), 2 * len(values), *values)


class Images(unittest.TestCase):
    def plant(self, port, *images, more=""):
        line = (f"  - {{name: eth, device: 'modbus-tcp://127.0.0.1:{port}', retries: 0, "
                f"timing: {{response_timeout: 100ms}}, stations: [{PRESS}, {OVEN}]}}\n")
        return config.gateway(line, modbus="listen: '127.0.0.1:0'", http=config.ADMIN) + f"images: [{', '.join(images)}]\n{more}"

    def foreign(self):
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
        server = subprocess.Popen([sys.executable, "-c", FOREIGN.replace("PORT", str(port))])
        self.addCleanup(server.wait)
        self.addCleanup(server.terminate)
        return port, server

    def test_one_read_brings_the_values_of_many_panels(self):
        port, _ = self.foreign()
        text = self.plant(port, image(), image("second", 101, "[oven/level]"))
        with harness.configured(text) as program, program.client() as client:
            whole = registers(LEVEL, OVEN_LEVEL, 0, 0, *FLOW, LOCKED)
            until(lambda: client.ask(100, read(0, 7)) == whole)
            self.assertEqual(client.ask(100, read(0, 7, 4))[1:], whole[1:], "input registers show the same")
            self.assertEqual(client.ask(100, read(1, 1)), registers(OVEN_LEVEL))
            self.assertEqual(client.ask(100, read(5, 2)), registers(FLOW[1], LOCKED), "a point's half")
            self.assertEqual(client.ask(100, read(6, 2)), bytes([0x83, 2]), "beyond the end")
            until(lambda: client.ask(100, read(0, 2, 1)) == bytes([1, 1, (1029 >> 3) & 1]))
            self.assertEqual(client.ask(100, read(0, 3, 1)), bytes([0x81, 2]))
            self.assertEqual(client.ask(101, read(0, 1)), registers(OVEN_LEVEL), "the second image")
            asked = self.transactions(program)
            for _ in range(50):
                client.ask(100, read(0, 7))
            self.assertLess(self.transactions(program) - asked, 50, "an image's reads go to no line")

    def transactions(self, program):
        text = program.rest("GET", "/metrics")[1]
        return sum(float(line.split()[-1]) for line in text.splitlines()
                   if line.startswith("panelgate_bus_transactions_total{"))

    def test_writes_are_writes_of_the_points(self):
        port, _ = self.foreign()
        with harness.configured(self.plant(port, image())) as program, program.client() as client:
            until(lambda: client.ask(100, read(0, 7))[0] == 3)
            self.assertEqual(client.ask(100, write_register(0, 4242)), write_register(0, 4242))
            until(lambda: client.ask(100, read(0, 1)) == registers(4242))
            self.assertEqual(client.ask(1, read_registers(9, 1)), registers(4242), "the panel has it")
            flow = struct.unpack(">HH", struct.pack(">f", 12.5))
            self.assertEqual(client.ask(100, write(4, *flow)), write(4, *flow)[:5])
            until(lambda: client.ask(100, read(4, 2)) == registers(*flow))
            self.assertEqual(client.ask(100, struct.pack(">BHH", 5, 1, 0xFF00)), struct.pack(">BHH", 5, 1, 0xFF00))
            until(lambda: client.ask(100, read(1, 1, 1)) == bytes([1, 1, 1]))
            for pdu, code, why in ((write_register(0, 5001), 3, "above max"),
                                   (write_register(1, 7), 2, "not writable"),
                                   (write_register(2, 7), 2, "free"),
                                   (write_register(4, 7), 2, "half a value"),
                                   (write(0, 1, 2), 2, "the second one is not writable"),
                                   (struct.pack(">BHH", 5, 0, 0xFF00), 2, "a bit that is not writable"),
                                   (struct.pack(">BHHH", 22, 0, 0, 1), 1, "no such function")):
                self.assertEqual(client.ask(100, pdu), bytes([pdu[0] | 0x80, code]), why)
            self.assertEqual(client.ask(100, read(0, 1)), registers(4242), "nothing of them was written")

    def test_a_panel_that_is_off(self):
        port, server = self.foreign()
        text = self.plant(port, image(), image("lasting", 101, POINTS, ", stale: last, quality: true"))
        with harness.configured(text) as program, program.client() as client:
            last = registers(LEVEL, 0, OVEN_LEVEL, 0, 0, 0, *FLOW, 0, LOCKED, 0)
            until(lambda: client.ask(101, read(0, 11)) == last)
            until(lambda: client.ask(101, read(0, 4, 1)) == bytes([1, 1, (1029 >> 3) & 1]))
            server.terminate()
            until(lambda: client.ask(100, read(0, 1)) == bytes([0x83, 0x0B]))
            self.assertEqual(client.ask(100, read(2, 2)), registers(0, 0), "free registers have no panel")
            until(lambda: client.ask(101, read(0, 2)) == registers(LEVEL, 1))
            self.assertEqual(client.ask(100, write_register(0, 1)), bytes([0x86, 0x0A]))

    def test_the_map_is_told(self):
        port, _ = self.foreign()
        text = self.plant(port, image())
        with harness.configured(text) as program:
            self.assertEqual(program.get("/api/v1/images")[1]["images"],
                             [{"name": "plant", "unit": 100, "stale": "exception", "quality": False,
                               "registers": 7, "bits": 2}])
            places = program.get("/api/v1/images/plant")[1]["points"]
            self.assertEqual([(p["table"], p["address"], p["count"], p["station"], p["point"]) for p in places],
                             [("holding-registers", 0, 1, "press", "level"),
                              ("holding-registers", 1, 1, "oven", "level"),
                              ("holding-registers", 4, 2, "press", "flow"), ("coils", 0, 1, "press", "on"),
                              ("coils", 1, 1, "oven", "hot"), ("holding-registers", 6, 1, "press", "locked")])
            asked = urllib.request.Request(program.url("/api/v1/images/plant"), headers={"Accept": "text/csv"})
            with urllib.request.urlopen(asked) as answer:
                rows = answer.read().decode().split("\r\n")
            self.assertEqual(rows[0], "table,address,count,quality_at,station,point,type,word_order,scale,offset,"
                                      "unit,writable")
            self.assertEqual(rows[3], "holding-registers,4,2,,press,flow,f32,ABCD,1,0,,true")
            self.assertEqual(program.get("/api/v1/images/other")[0], 404)

    def test_check_prints_the_map_and_refuses_a_unit_that_is_taken(self):
        def check(text):
            with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
                file.write(text)
                file.flush()
                return harness.run("check", "-c", file.name)
        told = check(self.plant(1502, image())).stdout
        self.assertIn("image plant: unit 100 with 7 registers and 2 bits, a value that is not good is 0B\n"
                      "  register 0 is press/level, u16, writable\n", told)
        self.assertIn("  registers 4 to 5 is press/flow, f32, writable\n", told)
        for wrong, words in ((image(unit=2), "unit 2 of listener 127.0.0.1:0 is station 'oven' already"),
                             (image(points="[press/nothing]"), "there is no point 'nothing'"),
                             (image(points="[kiln/level]"), "there is no station 'kiln'"),
                             (image(points="[press]"), "points lists STATION/POINT"),
                             (image(points="[]"), "an image needs points"),
                             (image(points="[{skip: 0}]"), "skip"),
                             (image(points="[{skip: 65536}, press/level]"), "at most 65536 registers"),
                             (image() + ", " + image("again"), "two images with unit 100")):
            said = check(self.plant(1502, wrong))
            self.assertNotEqual(said.returncode, 0, wrong)
            self.assertIn(words, said.stderr)
        taken = self.plant(1502, image()).replace("listen: '127.0.0.1:0'", "listen: '127.0.0.1:0', "
                                                  "units: {100: eth/1}")
        self.assertIn("is eth/1 already", check(taken).stderr)

    @unittest.skipUnless(shutil.which("mbpoll"), "no mbpoll")
    def test_mbpoll_reads_an_image(self):
        port, _ = self.foreign()
        with harness.configured(self.plant(port, image())) as program:
            with program.client() as client:
                until(lambda: client.ask(100, read(0, 7))[0] == 3)
            said = subprocess.run(["mbpoll", "-m", "tcp", "-a", "100", "-p", str(program.modbus_port()), "-1", "-q",
                                   "-0", "-r", "0", "-c", "7", "127.0.0.1"], capture_output=True, text=True,
                                  timeout=harness.PATIENCE)
            self.assertRegex(said.stdout, rf"\[0\]:\s+{LEVEL}\n\[1\]:\s+{OVEN_LEVEL}\n")

    def test_a_reload_changes_an_image(self):
        port, _ = self.foreign()
        with Running(self.plant(port, image())) as running, running.program.client() as client:
            def reload(text):
                self.assertEqual(running.reload(text)[0], 200)
            until(lambda: client.ask(100, read(0, 7))[0] == 3)
            reload(self.plant(port, image(points="[oven/level]")))
            self.assertEqual(client.ask(100, read(0, 1)), registers(OVEN_LEVEL))
            reload(self.plant(port, image("other", 102, "[oven/level]")))
            self.assertEqual(client.ask(102, read(0, 1)), registers(OVEN_LEVEL))
            self.assertIn(client.ask(100, read(0, 1))[1], (0x0A, 0x0B), "no image any more")


if __name__ == "__main__":
    unittest.main()
